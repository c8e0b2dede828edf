"""Trace in rounds up to a target of accuracy or a time, each of them shown on the faces."""

from dataclasses import replace

from .attributes import RESULTS
from .session import find_city, find_session
from .show_result import show_result
from .summarise import summarise_interruption
from .write_attributes import write_results


def read_goal(seeing, request):
    """Set the target and the time of further rounds in a Request, as the panel has them."""
    if seeing.refine:
        request.target_error = seeing.target_error or None
        request.time_budget = seeing.time_budget or None


def wants_rounds(request):
    """Whether a trace goes on after its first round."""
    return request.target_error is not None or request.time_budget is not None


def trace_rounds(session, weather, request, progress):
    """Transfer of a session's scene: of one round, or of as many as target and time ask for.

    Every round is left in `session.round`, with the energy that the Transfer of all rounds so far has. The numbers are
    those of the command line with as many rounds. Cancelled among further rounds, those that are finished are kept.

    Parameters
    ----------
    session : Session
    weather : Weather
    request : Request
    progress : callable
        See `core.progress`.

    Returns
    -------
    Transfer
    """
    from ..core.study import trace_scene

    if not wants_rounds(request):
        return trace_scene(session.scene, weather, request, progress)
    from ..core.commands.run_log import RunLog
    from ..core.commands.simulate import trace_until_interrupted
    from ..core.light.prepare_scene import prepare_scene
    from ..core.study import choose_year, compute_energy

    class Log(RunLog):
        def show(self, transfer):
            # The matrices of the next rounds go into the same arrays: only means of surfaces are shown.
            energy = compute_energy(transfer, weather, request)
            session.round = replace(transfer, visible_share=None, direct_reflected=None), energy

    log = Log(None)
    log.progress = progress
    suns = choose_year(weather, request)
    prepared = prepare_scene(session.scene, request, weather=weather, suns=suns, progress=progress)
    transfer = trace_until_interrupted(session.scene, weather, request, log, None, prepared=prepared)
    session.round = None
    return transfer


def show_round(context, session):
    """Show the last round of a session, if there is a new one: write its results, colour the chosen or the best one."""
    if session is None or session.round is None:
        return
    (transfer, energy), session.round = session.round, None
    city, ground = find_city(context.scene)
    if find_session(city) is not session:
        return  # the user switched to another city
    write_results(city, ground, transfer, energy)
    summarise_interruption(city, None)
    chosen = context.scene.citypv.attribute
    show_result(context, city, ground, chosen if chosen in RESULTS else "full_load_hours")
