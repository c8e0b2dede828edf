"""Trace: compute the Transfer of a Scene, the relative irradiance of each surface."""

import bpy

from ..core.effects.table import PLANNING
from ..core.settings.progress import SUN_STAGE
from ..core.sky.light_sources import SOURCES
from .compile_loops import COMPILING, compile_loops
from .keep_report import keep_report
from .plan_effects import keep_plan
from .read_materials import read_finishes, remember_materials
from .read_settings import read_settings
from .refine_trace import read_goal, show_round, trace_rounds, wants_rounds
from .run_step import Step
from .select_faces import leave_edit_mode
from .session import find_city, find_own_city, find_session
from .show_result import show_result
from .step_state import remember_step
from .summarise import forget_energy, summarise_albedo, summarise_interruption
from .write_attributes import write_results

SUNS_PER_DAY = 12


class TraceCity(Step, bpy.types.Operator):
    """Trace light from sky and sun, with reflections, to every surface"""

    bl_idname = "citypv.trace"
    bl_label = "Trace light"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """The city has been classified in this session."""
        cls.poll_message_set("Classify the city first")
        session = find_session(find_city(context.scene)[0])
        return session is not None and session.scene is not None

    def prepare(self, context):
        """Take the scene and the settings."""
        city, ground = find_city(context.scene)
        session = find_session(city)
        leave_edit_mode(context)
        remember_materials(city, ground, session)
        request, unread = read_settings(context.scene.citypv), []
        read_goal(context.scene.citypv_seeing, request)
        if context.scene.citypv.albedo_source == "materials":
            request.ground_material = session.ground_material
            names = [session.ground_material, *(session.scene.surfaces.material or [])]
            request.materials, unread = read_finishes(names, session.scene.colours)
        return session, request, unread

    def expect(self, task):
        """Rays of each stage; those of the sky also find what reflects to what, those of the suns have reflections."""
        _, request, _ = task
        if request.estimator == "forward" or wants_rounds(request):
            return None
        sky, sun = count_rays(request)
        stages = {
            COMPILING: 0.01 * sky,
            "reading weather": 0.04 * sky,
            PLANNING: 0.08 * sky,
            "sky and reflections": sky,
        }
        stages |= {"reflections of the sky": 0.1 * sky} | dict.fromkeys(SOURCES, 0.2 * sky)
        return stages | {SUN_STAGE: sun}

    @staticmethod
    def work(task, progress):
        """Trace; the weather only provides the hours."""
        from ..core.materials.read_albedo import describe_albedo
        from ..core.results.list_findings import list_findings
        from ..core.study import check_tracing, read_year

        session, request, unread = task
        check_tracing(request)
        albedos = describe_albedo(session.scene, request)
        compile_loops(progress)
        progress("reading weather", 0, 1, "years")
        weather = read_year(session.scene.site, request)
        transfer = trace_rounds(session, weather, request, progress)
        findings = list_findings(session.scene, transfer.covered_share)
        return session, weather, transfer, findings, (albedos, unread)

    def refine(self, context):
        """Show the last round."""
        show_round(context, find_session(find_city(context.scene)[0]))

    def finish(self, context, result):
        """Keep the light, and show that of the sky."""
        session, _, transfer, *_ = result
        interrupted = keep_light(context, *result)
        shown = show_result(context, *find_own_city(context.scene, session), "diffuse_relative")
        traced = interrupted or f"Traced {len(transfer.surfaces)} surfaces and {len(transfer.suns)} suns"
        return f"{traced}; shown: {shown.title[0].lower()}{shown.title[1:]}"


def count_rays(request):
    """Rays from each patch to the sky (with what they find of reflections) and to the suns, roughly: two float."""
    way, _, number = request.suns.partition(":")
    suns = int(number or 0) * SUNS_PER_DAY if "days" in way else int(number or SUNS_PER_DAY * 365)
    return 2.0 * request.samples, float(suns * request.shadow_samples)


def keep_light(context, session, weather, transfer, findings, albedos):  # noqa: PLR0917
    """Write results that do not depend on weather, and remove those of an earlier weather.

    Parameters
    ----------
    context : bpy.types.Context
    session, weather, transfer, findings, albedos
        Of `TraceCity.work`.

    Returns
    -------
    str
        Which suns were traced, if not all.
    """
    city, ground = find_own_city(context.scene, session)
    write_results(city, ground, transfer)
    forget_energy(city)
    keep_report(city, session.scene, findings)
    summarise_albedo(city, *albedos)
    keep_plan(city, transfer.record.effects if transfer.record else ())
    remember_step(city, "trace", context.scene.citypv)
    session.weather, session.transfer, session.energy = weather, transfer, None
    return summarise_interruption(city, transfer.record.interrupted)
