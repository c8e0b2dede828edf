"""How far the models of the sky are from measured walls, and from the hours of ISO 52010-1.

    python benchmarks/sky.py [--plot docs/validation/sky.png]

Measured: global irradiance on four walls of a house in open country (Holzkirchen, IEA EBC Annex
58), 41 days in 2013 and 40 in 2014, every ten minutes. GHI and DHI of the same station go through
this program's own chain (sun, DNI, traced walls, sky, ground of albedo 0.23); hourly means with the
sun above 3° are compared. ISO 52010-1: the test case "drycold", hourly totals on four planes,
daylight hours, ground of albedo 0.2. Beside both, pvlib's `perez` in the same weather. matplotlib
is needed for the picture only.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib

from citypv.core.commands.plain_scenes import join_parts, rectangle
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.trace_gather import trace_gather
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.weather import Record

DATA = Path(__file__).parents[1] / "tests" / "data" / "sky"
HOUR = pd.Timedelta(hours=1)
HOLZKIRCHEN = (47.874, 11.728, 680.0)  # latitude [°], longitude [°], altitude [m]
GROUND = 0.23  # albedo
# tilt, azimuth [°]
WALLS = {
    "north": (90, 0),
    "east": (90, 90),
    "south": (90, 180),
    "west": (90, 270),
}
FIRST = {1: 10, 2: 5}  # [min] from the start of an interval to its stamp, by period of measurement
YEARS = {1: 2013, 2: 2014}
LOWEST = 3.0  # [°] of the sun in the hours that are compared
DRYCOLD = (39.76, -104.86, 1609.0)
ISO_GROUND = 0.2
PLANES = {"I_tot_s1": (90, 90), "I_tot_s2": (90, 270), "I_tot_s3": (0, 0), "I_tot_s4": (30, 135)}
SKIES = ("isotropic", "perez")


def main():
    """Print the tables in Markdown, and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    measured = {year: compare_walls(period) for period, year in YEARS.items()}
    print("Measured walls: bias / root mean square difference [W/m²] of hourly means\n")
    print("| year | wall | isotropic | Perez | Perez by pvlib |\n|---|---|--:|--:|--:|")
    for year, walls in measured.items():
        for wall, found in walls.items():
            print(
                f"| {year} | {wall} | "
                + " | ".join(words(*found[model]) for model in (*SKIES, "pvlib"))
                + " |"
            )
    print("\nISO 52010-1: bias / root mean square difference [W/m²] of hours\n")
    print(
        "| plane | isotropic | Perez | Perez by pvlib | Perez with the norm's clearness "
        "|\n|---|--:|--:|--:|--:|"
    )
    for plane, found in compare_norm().items():
        print(
            f"| {plane} | "
            + " | ".join(words(*found[model]) for model in (*SKIES, "pvlib", "norm"))
            + " |"
        )
    if options.plot:
        draw(measured, options.plot)


def words(bias, difference):
    """Bias and root mean square difference as a cell of a table."""
    return f"{bias:+.1f} / {difference:.1f}"


def read_walls(period):
    """Weather of a period of measurement, and the measured walls [W/m²], every ten minutes."""
    table = pd.read_csv(DATA / "twinhouse_solar_10min.csv.gz")
    table = table[table["exp"] == period]
    start = pd.DatetimeIndex(pd.to_datetime(table["time_utc"], utc=True)) - pd.Timedelta(
        minutes=FIRST[period]
    )
    data = table[["ghi", "dhi"]].set_axis(start, axis=0).assign(temp_air=15.0, wind_speed=1.0)
    weather = add_sun(
        Record(data, *HOLZKIRCHEN, "twin houses", "twin houses"), pd.Timedelta(minutes=10)
    )
    return weather, table[["n", "e", "s", "w"]].set_axis(list(WALLS), axis=1).set_axis(
        start, axis=0
    )


def compare_walls(period):
    """Bias and root mean square difference of each wall and model: dict of dict of tuple."""
    weather, measured = read_walls(period)
    hour = weather.data.index.floor("h")
    high = (90 - weather.data["apparent_zenith"]).groupby(hour).mean() > LOWEST
    found = {}
    for wall, plane in WALLS.items():
        true = measured[wall].groupby(hour).mean()[high]
        models = {sky: own_chain(weather, plane, sky, GROUND) for sky in SKIES}
        models["pvlib"] = pvlib_alone(weather, plane, GROUND)
        means = {
            name: pd.Series(one, weather.data.index).groupby(hour).mean()[high]
            for name, one in models.items()
        }
        found[wall] = {name: distance(one - true) for name, one in means.items()}
    return found


def distance(difference):
    """Mean and root mean square of differences."""
    return float(difference.mean()), float(np.sqrt((difference**2).mean()))


def own_chain(weather, plane, sky, albedo):
    """Irradiance of an open plane by this program, (t,) [W/m²], in each interval."""
    tilt, azimuth = np.radians(plane)
    along = [-np.cos(azimuth), np.sin(azimuth), 0]
    across = [-np.cos(tilt) * np.sin(azimuth), -np.cos(tilt) * np.cos(azimuth), np.sin(tilt)]
    scene = join_parts([rectangle([0, 0, 0], along, across)])
    suns = choose_suns("hourly", *weather.axis)
    transfer = trace_gather(scene, suns, Request(sky=sky, ground_albedo=albedo), silent)
    series = compute_energy(transfer, weather, sky=sky, series=[0]).series
    return (series.poa_direct + series.poa_diffuse)[:, 0]


def pvlib_alone(weather, plane, albedo):
    """The same by pvlib's `perez`."""
    data = weather.data
    zenith, azimuth = data["apparent_zenith"], data["solar_azimuth"]
    airmass = pvlib.atmosphere.get_relative_airmass(zenith)
    extra = pvlib.irradiance.get_extra_radiation(data.index + weather.interval / 2).to_numpy()
    sky = pvlib.irradiance.perez(*plane, data["dhi"], data["dni"], extra, zenith, azimuth, airmass)
    ghi = data["dhi"] + data["dni"] * np.cos(np.radians(zenith)).clip(lower=0)
    direct = pvlib.irradiance.beam_component(*plane, zenith, azimuth, data["dni"])
    return (
        direct + sky.fillna(0) + pvlib.irradiance.get_ground_diffuse(plane[0], ghi, albedo)
    ).to_numpy()


def compare_norm():
    """The same for the planes of ISO 52010-1."""
    table = pd.read_csv(DATA / "iso52010_drycold_test_data.csv.gz")
    start = pd.date_range("2013-01-01T07:00Z", periods=len(table), freq="h")
    data = (
        table[["G_dir", "G_dif"]]
        .astype(float)
        .set_axis(["dni", "dhi"], axis=1)
        .set_axis(start, axis=0)
    )
    weather = add_sun(
        Record(data.assign(temp_air=15.0, wind_speed=1.0), *DRYCOLD, "drycold", "drycold"), HOUR
    )
    daylight = (weather.data["apparent_zenith"] < 90).to_numpy()
    found = {}
    for name, plane in PLANES.items():
        models = {sky: own_chain(weather, plane, sky, ISO_GROUND) for sky in SKIES}
        models |= {
            "pvlib": pvlib_alone(weather, plane, ISO_GROUND),
            "norm": norms_clearness(weather, plane),
        }
        true = table[name].to_numpy()
        title = f"tilt {plane[0]}°, azimuth {plane[1]}°"
        found[title] = {model: distance((one - true)[daylight]) for model, one in models.items()}
    return found


def norms_clearness(weather, plane):
    """Perez's model as the norm's numbers have it: clearness from the sun's altitude in place of
    its zenith angle.

    ε = ((DHI + DNI)/DHI + 1.014 α³) / (1 + 1.014 α³)    instead of 1.041 z³
    """
    data = weather.data
    zenith, azimuth = data["apparent_zenith"].to_numpy(), data["solar_azimuth"].to_numpy()
    dni, dhi = data["dni"].to_numpy(), data["dhi"].to_numpy()
    altitude = np.radians(np.maximum(90 - zenith, 0))
    term = 1.014 * altitude**3
    clearness = ((dhi + dni) / np.maximum(dhi, 1e-9) + term) / (1 + term)
    # pvlib computes the clearness itself: the DNI that gives it this clearness, for the
    # coefficients alone.
    own = 1.041 * np.radians(zenith) ** 3
    equivalent = np.maximum((clearness * (1 + own) - own - 1) * dhi, 0)
    extra = pvlib.irradiance.get_extra_radiation(data.index + weather.interval / 2).to_numpy()
    airmass = pvlib.atmosphere.get_relative_airmass(zenith)
    sky = pvlib.irradiance.perez(*plane, dhi, equivalent, extra, zenith, azimuth, airmass)
    direct = pvlib.irradiance.beam_component(*plane, zenith, azimuth, dni)
    ghi = dhi + dni * np.maximum(np.cos(np.radians(zenith)), 0)
    return (
        direct + np.nan_to_num(sky) + pvlib.irradiance.get_ground_diffuse(plane[0], ghi, ISO_GROUND)
    )


def draw(measured, path):
    """Picture: root mean square difference of each wall, isotropic and Perez, both years."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    for axes, (year, walls) in zip(
        figure.subplots(1, len(measured), sharey=True), measured.items(), strict=True
    ):
        place = np.arange(len(walls))
        for shift, sky, colour in ((-0.2, "isotropic", "#9a9a9a"), (0.2, "perez", "#D55E00")):
            heights = [found[sky][1] for found in walls.values()]
            bars = axes.bar(place + shift, heights, 0.38, color=colour, label=sky.capitalize())
            axes.bar_label(bars, fmt="%.0f", fontsize=8)
        axes.set_xticks(place, [f"{wall} wall" for wall in walls])
        axes.set_title(str(year))
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("rms difference from\nmeasurement [W/m²]")
    figure.axes[-1].legend(frameon=False)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    main()
