"""Update: compute an edited city from what is known of it before the edit, and show who gains and who loses."""

import bpy
import numpy as np

from ...core.settings.errors import InputError
from ..city.classify_city import show_kinds
from ..city.read_settings import ASKED, read_settings
from ..light.trace_city import keep_light
from ..members import describe_edit, has_edits
from ..picture.show_result import find_before
from ..result.compare_results import KeepBefore
from ..result.compute_energy import WeighEnergy
from ..run_step import OfCity, Step, leave_edit_mode
from ..session import Session, find_city, find_own_city, find_session, find_state
from .read_seen import read_seen

AGAIN = "classify and trace it again: edits start from what its rays met (an opened file, rounds and forward keep none)"
OF_BASE = ("import", "classify", "trace")  # steps whose settings are those of the city before


class UpdateCity(OfCity, Step, bpy.types.Operator):
    """Compute the city as it is seen now: only what the edit touches is traced, with the numbers of a full run"""

    bl_idname, bl_label = "citypv.update", "Update"
    bl_options = set()  # it is no step of undo: undo takes back the edit
    stages = {"building the scene": 1, "sky and reflections": 2, "suns": 3, "electricity": 2}
    tried = None  # state of the city that was computed last

    @classmethod
    def poll(cls, context):
        """There is an edit, and light to start from."""
        city, _ = find_city(context.scene)
        cls.poll_message_set("Trace the light of a city first; then edit it")
        return can_update(city) and has_edits(city)

    def prepare(self, context):
        """Read the city as it is seen."""
        city, _ = find_city(context.scene)
        session = find_session(city)
        if session is None or session.base is None:
            raise InputError(city.name, "its light cannot be edited", AGAIN)
        problem, cure = describe_edit(city)
        if "beside" in problem:
            raise InputError(city.name, problem, cure)
        leave_edit_mode(context)
        seen, request = read_seen(context, city, session), read_settings(context.scene.citypv)
        UpdateCity.tried = state = seen.design, repr(request)
        before = find_session(find_before(context.scene, city)) or session
        return session, seen, request, state, find_state(state), before.base

    @staticmethod
    def work(task, progress):
        """Put the city on its ground; trace what the edit changes; weigh it with the weather."""
        from ...core.patches.read_albedo import describe_albedo
        from ...core.results.list_findings import list_findings
        from ...core.study import trace_edit

        session, seen, request, state, known, before = task
        if known is None:
            base = session.base
            imported, city = seen.make()
            edited = trace_edit(base, city, progress)
            scene, transfer = edited.leaf.prepared.scene, edited.transfer
            known = Session(city=city, imported=imported, scene=scene, base=edited, transfer=transfer, state=state)
            findings = list_findings(scene, transfer.covered_share)
            traced = (known, None, transfer, findings, (describe_albedo(scene, base.request), []))
            known.told = traced, WeighEnergy.work((known, None, request), progress)
        known.change = tell_errors(before, known, known.told[1][1], request)
        return session, seen, known

    def finish(self, context, result):
        """Keep the result before the first edit, and show the edited city with what it gains or loses."""
        session, seen, known = result
        city, ground = find_own_city(context.scene, session)
        asked = {ASKED + step: city[ASKED + step] for step in OF_BASE if ASKED + step in city}
        if find_before(context.scene, city) is None and session.energy is not None:
            KeepBefore.act(self, context, city, ground)
        told = traced, (_, *energy) = known.told
        show_kinds(context, session, known, traced[3], seen)
        keep_light(context, *traced)
        known.told, UpdateCity.tried = told, None
        text = WeighEnergy.finish(self, context, (known, *energy))
        for key, value in asked.items():  # the settings are those of the base
            find_city(context.scene)[0][key] = value
        return text


def can_update(city):
    """Whether a city has light that can be edited."""
    return getattr(find_session(city), "base", None) is not None


def update_in_script(context):
    """Update a city that was edited by a script, as a window does by itself."""
    if bpy.app.background and context.scene.citypv_seeing.live and bpy.ops.citypv.update.poll():
        bpy.ops.citypv.update()


def tell_errors(before, after, weather, request):
    """Standard errors of the change of full load hours, whose noise before and after cancels.

    Parameters
    ----------
    before : EditableCity or None
    after : Session
        Of an edit of it.
    weather : core.weather.weather.Weather
    request : core.settings.request.Request

    Returns
    -------
    tuple of EditableCity, dict, or None
        The same as `before`, and the errors [h] by surface_id.
    """
    from ...core.light.difference import errors_of_difference
    from ...core.study import compute_energy

    if before is None or after.base is None or before is after.base:
        return None
    transfer, _ = errors_of_difference(before, after.base)
    errors = compute_energy(transfer, weather, request).full_load_hours_standard_error
    return before, dict(zip(transfer.surfaces.surface_id, np.asarray(errors).tolist(), strict=True))
