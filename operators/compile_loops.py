"""Compile the loops of core once per computer, as a stage of its own: it takes half a minute."""

from dataclasses import replace

COMPILING = "compiling for this computer, only once"
STEPS = 3


def compile_loops(progress):
    """Trace a small scene if the compiled loops are not kept on this computer yet; returns at once if they are.

    Parameters
    ----------
    progress : callable
        See `core.progress`.
    """
    from ..core.sampling.hemisphere_rays import is_compiled

    if is_compiled():
        return
    from ..core.light.measure_cover import measure_cover
    from ..core.request import Request
    from ..core.selfcheck.plain_scenes import box, join_parts
    from ..core.study import read_year, trace_scene

    progress(COMPILING, 0, STEPS, "steps")
    scene = join_parts(box((0, 0, 0), (10, 10, 10)))
    scene = replace(scene, site=replace(scene.site, latitude=0.0, longitude=0.0))
    measure_cover(scene)
    progress(COMPILING, 1, STEPS, "steps")
    request = Request(weather="clear-sky", suns="days:2", samples=16, shadow_samples=2)
    weather = read_year(scene.site, request)
    progress(COMPILING, 2, STEPS, "steps")
    trace_scene(scene, weather, request)
    progress(COMPILING, STEPS, STEPS, "steps")
