"""Error against time: what each setting costs on a scene, with the presets marked."""

from .picture import DOTS, make_figure, make_logarithmic, plain_style

FAMILIES = {  # beginning of the name -> label, colour, mark
    "--samples": ("sky rays", "#0072B2", "s"),
    "--shadow-samples": ("shadow points", "#E69F00", "^"),
    "--suns days": ("days of suns", "#D55E00", "o"),
    "--max-bounces": ("reflections", "#009E73", "v"),
    "--patch-size": ("patch size", "#CC79A7", "D"),
}


def draw_prices(listed, path):
    """Write the curve of a PriceList, error on 95 % of the eligible area against seconds of the whole run.

    Parameters
    ----------
    listed : PriceList
    path : path-like
    """
    with plain_style():
        figure = make_figure(8, 5)
        axes = figure.subplots()
        for start, (label, colour, mark) in FAMILIES.items():
            points = sorted((one.seconds, one.error) for one in listed.prices if one.name.startswith(start))
            axes.plot(*zip(*points, strict=True), color=colour, marker=mark, label=label) if points else None
        for one in listed.prices:
            if not one.name.startswith("--") and not one.name.endswith("rounds"):
                axes.plot(one.seconds, one.error, "k*", markersize=13, zorder=5)
                axes.annotate(one.name.capitalize(), (one.seconds, one.error), (6, 6), textcoords="offset points")
        make_logarithmic(axes)
        axes.set_xlabel("Seconds of the whole run (predicted)")
        axes.set_ylabel("Error of full load hours on 95 % of the eligible area [%]")
        axes.legend()
        figure.savefig(path, dpi=DOTS)
