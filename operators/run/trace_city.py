"""Trace: compute the Transfer of a Scene, in one round or, up to a target or a time, in further
ones.
"""

from dataclasses import replace
from queue import SimpleQueue

import bpy

from ...core.city.building_facts import tell_facts
from ...core.effects.table import PLANNING
from ...core.settings.errors import count_of
from ...core.settings.progress import SUN_STAGE
from ..city.attributes import RESULTS, Faces
from ..city.job import COMPILING
from ..city.keys import Key
from ..city.read_materials import read_finishes, remember_materials
from ..city.read_settings import remember_step
from ..city.run_step import Step, leave_edit_mode
from ..city.session import Session, find_city
from ..show.keep_report import keep_report
from ..show.show_result import show_result
from .plan_trace import OfScene, keep_plan, prepare_weather
from .summarise import OF_ENERGY, summarise_albedo


class TraceCity(OfScene, Step, bpy.types.Operator):
    """Trace light from sky and sun, with reflections, to every surface"""

    bl_idname, bl_label = "citypv.trace", "Trace light"

    def prepare(self, context):
        """Take the scene and the settings."""
        (session, request), unread = OfScene.prepare(self, context), []
        leave_edit_mode(context)
        remember_materials(*find_city(context.scene), session)
        read_goal(context.scene.citypv_seeing, request)
        if context.scene.citypv.albedo_source == "materials":
            request.ground_material = session.ground_material
            names = [session.ground_material, *(session.scene.surfaces.material or [])]
            request.materials, unread = read_finishes(names, session.scene.colours)
        self._found, self.stages = SimpleQueue(), stages_of_trace(request)
        return session, request, unread, self._found

    @staticmethod
    def work(task, progress):
        """Trace; the weather only provides the hours. Rounds are left in the task's queue, see
        `_trace_rounds`.
        """
        from ...core.patches.read_albedo import describe_albedo
        from ...core.results.list_findings import list_findings
        from ...core.run.study import check_tracing

        session, request, unread, found = task
        check_tracing(request)
        albedos = describe_albedo(session.scene, request)
        weather = prepare_weather(session, request, progress)
        transfer, base = _trace_rounds(session, weather, request, progress, found)
        transfer = replace(transfer, facts=tell_facts(session.city))
        findings = list_findings(session.scene, transfer.covered_share)
        return (
            session,
            Session(weather=weather, transfer=transfer, base=base),
            findings,
            (albedos, unread),
        )

    def refine(self, context):
        """Show the last round."""
        for _, found in [self._found.get() for _ in range(self._found.qsize())][-1:]:
            show_round(context, *found)

    def finish(self, context, result):
        """Keep the light, and show the sky's part."""
        session, *_ = result
        interrupted, transfer = keep_light(context, *result), session.transfer
        session.energy = session.cached = None
        remember_step(session.find_city(context.scene)[0], "trace", context.scene.citypv)
        shown = show_result(context, *session.find_city(context.scene), "diffuse_relative")
        traced = interrupted or (
            f"Traced {count_of(len(transfer.surfaces), 'surface')} and "
            f"{count_of(len(transfer.suns), 'sun')}"
        )
        return f"{traced}; shown: {shown.title[0].lower()}{shown.title[1:]}"


def stages_of_trace(request):
    """Work of each stage of a trace: the sky's also finds what reflects to what, the suns' has
    reflections.

    Returns
    -------
    dict of str to float
        None where it is not known: of photons, and of rounds.
    """
    if request.estimator == "forward" or request.wants_rounds:
        return None
    sky, sun = work_of_trace(request)
    shares = {COMPILING: 0.01, "reading weather": 0.04, PLANNING: 0.05, "sky and reflections": 1.0}
    shares |= {"number of reflections": 0.3, "reflections of the sky": 0.05, "horizon": 0.05}
    work = {stage: share * sky for stage, share in shares.items()} | {SUN_STAGE: sun}
    return work | {f"error check {number} of 2": 0.1 * sky for number in (1, 2)}


def work_of_trace(request, *, suns_per_day=12):
    """What tracing a patch takes for the sky and for the suns, roughly, in units of a ray to the
    sky: two float.
    """
    way, _, number = request.suns.partition(":")
    suns = int(number or 0) * suns_per_day if "days" in way else int(number or suns_per_day * 365)
    # In units of a ray to the sky: 175 for a patch beside its rays, 0.5 for each sun, 0.1 for each
    # point there.
    return 175.0 + request.samples, suns * (0.5 + 0.1 * request.shadow_samples)


def keep_light(context, session, traced, findings, albedos):
    """Write results that do not depend on weather, and remove results of an earlier weather.

    Parameters
    ----------
    context : bpy.types.Context
    session, found, findings, albedos
        Of `TraceCity.work`; `session` gets the weather, the transfer and the base that were
        `traced`.

    Returns
    -------
    str
        Which suns were traced, if not all.
    """
    (city, ground), transfer = session.find_city(context.scene), traced.transfer
    Faces(city, ground).write_results(transfer)
    for key in OF_ENERGY:
        city.pop(key, None)
    keep_report(city, session.scene, findings)
    summarise_albedo(city, *albedos)
    keep_plan(city, transfer.record.effects if transfer.record else ())
    session.weather, session.transfer, session.base = traced.weather, transfer, traced.base
    session.base_city = None
    interrupted = transfer.record.interrupted
    city[Key.INTERRUPTED] = (
        "Interrupted: kept {suns_traced} of {of} suns".format(**interrupted) if interrupted else ""
    )
    return city[Key.INTERRUPTED]


def read_goal(seeing, request):
    """Set the target and the time of further rounds in a Request, as the panel has them."""
    if seeing.refine:
        request.target_error = seeing.target_error or None
        request.time_budget = seeing.time_budget or None


def _trace_rounds(session, weather, request, progress, rounds):
    """Trace a session's scene as the command line does: its Transfer, and the EditableCity of a
    single round of gather or None.

    Every further round is left in the queue `rounds` as ("rounds", (session, Transfer of all so
    far, its energy)). Cancelled among further rounds, those that are finished are kept.
    """
    from ...core.run.run_log import RunLog
    from ...core.run.simulate import trace_city
    from ...core.run.study import compute_energy, prepare_study

    def show(transfer):
        # The matrices of the next rounds go into the same arrays: only means of surfaces are shown.
        energy = compute_energy(transfer, weather, request)
        shown = replace(transfer, visible_share=None, direct_reflected=None)
        rounds.put(("rounds", (session, shown, energy)))

    log = RunLog(None, progress)
    log.show = show
    prepared = prepare_study(session.scene, weather, request, progress=progress)
    editable = request.estimator == "gather" and not request.wants_rounds
    return trace_city(session.scene, weather, request, log, prepared=prepared, editable=editable)


def show_round(context, session, transfer, energy):
    """Show a round of a session's trace: write its results, colour the chosen or the best one."""
    city, ground = find_city(context.scene)
    if Session.of(city) is not session:
        return  # the user switched to another city
    Faces(city, ground).write_results(transfer, energy)
    city[Key.INTERRUPTED] = ""
    chosen = context.scene.citypv.attribute
    show_result(context, city, ground, chosen if chosen in RESULTS else "full_load_hours")
