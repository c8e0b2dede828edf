"""Update: compute an edited city from what is known of it before the edit, and show who gains and
who loses.
"""

from dataclasses import replace
from queue import SimpleQueue

import bpy
import numpy as np

from ...core.city.building_facts import tell_facts
from ..city import edit_marks
from ..city.attributes import CHANGE, Faces
from ..city.keys import Key
from ..city.read_settings import read_settings
from ..city.run_step import OfCity, Step, leave_edit_mode, redraw_panels
from ..city.session import Session, find_city, list_cities
from ..show.show_result import find_before, show_result
from . import city_design
from .classify_city import show_kinds
from .compare_results import KeepBefore, values_of_surfaces
from .compute_energy import WeighEnergy
from .edited_city import read_edited_city
from .trace_city import keep_light

HOURS = "full_load_hours"


class UpdateCity(OfCity, Step, bpy.types.Operator):
    """Compute the city as it is seen now: only what the edit changes is traced"""

    bl_idname, bl_label = "citypv.update", "Update"
    bl_options = set()  # it is no step of undo: undo takes back the edit
    # The user waits for it, while the window draws nothing but its colours: without a graphics card
    # that would take all of two cores for two of the seconds that it takes.
    niceness = 0
    stages = {
        "building the scene": 1,
        "what the change reaches": 8,
        "reflections of the sky": 4,
        "suns": 1,
        "each sun": 2,
        "electricity": 3,
    }
    # state of the city that was asked for last, until it is computed or the city is another one
    tried = None

    @classmethod
    def poll(cls, context):
        """There is an edit, and light to start from."""
        city, _ = find_city(context.scene)
        cls.poll_message_set("Trace the light of a city first; then edit it")
        return Session.can_update(city) and city_design.has_edits(city)

    def prepare(self, context):
        """Read the city as it is seen."""
        city, _ = find_city(context.scene)
        session = Session.of(city)
        if city_design.hinders_update(city):
            edit_marks.check_unedited(city)
        leave_edit_mode(context)
        seen, request = (
            read_edited_city(context, city, session),
            read_settings(context.scene.citypv),
        )
        UpdateCity.tried = state = seen.design, repr(request)
        before = Session.of(find_before(context.scene, city)) or session
        self._found, self._shown, self._asked = SimpleQueue(), session, seen.design
        return session, seen, request, state, Session.find_cached(state), before, self._found

    @staticmethod
    def work(task, progress):
        """Put the city on its ground; trace what the edit changes; weigh it with the weather.

        Returns what was read from the Blender scene, the Session of the edited city, the one before
        in the light of the edit (None where it is in this light already), and errors of the change.
        """
        from ...core.patches.read_albedo import describe_albedo
        from ...core.results.list_findings import list_findings
        from ...core.run.variant import trace_edit

        # If the edit was not traced yet: the edited city is made, and what changes is traced.
        session, seen, request, state, known, before, found = task
        solved = None
        if known is None:
            base = session.base
            imported, city = seen.make()
            traced = session.base_city or session.city

            # A guess of the hours is shown before the suns are solved.
            def preview(scene, *light):
                if session.energy is not None and found.empty():
                    draft = Session(
                        city=city, imported=imported, scene=scene, base=base, base_city=traced
                    )
                    found.put((draft, seen, estimate_hours(session, scene, light)))

            scene, edited = trace_edit(base, traced, city, progress=progress, preview=preview)
            # The edited city becomes a Session with its findings, and is weighed with the weather.
            solved = edited.before if before.base is base else None
            edited = replace(edited, before=None)
            transfer = replace(edited.transfer, facts=tell_facts(city))
            known = Session(city, imported, scene, transfer=transfer, base=edited, design_key=state)
            findings = list_findings(scene, edited.transfer.covered_share)
            light = known, known, findings, (describe_albedo(scene, base.request), [])
            # The weather is known where nothing that was asked for has changed.
            same = session.energy is not None and repr(session.request) == repr(request)
            known.cached = (
                light,
                WeighEnergy.work(
                    (known, None, request), progress, session.weather if same else None
                ),
            )
        # The result before the edit, in the light that the edit asks for, for comparison.
        earlier = _match_before(before, known, solved, progress)
        return (
            seen,
            known,
            earlier,
            tell_errors((earlier or before).base, known.base, *known.cached[1][2:5]),
        )

    def modal(self, context, event):
        """Wait until the user has finished a newer edit: it may need nothing of this one."""
        ended = event.type == "TIMER" and not self._job.is_alive()
        return {"PASS_THROUGH"} if ended and is_editing(context) else super().modal(context, event)

    def is_wanted(self, context):
        """Whether the city is seen as it was asked for: an edit that was undone, or a newer one,
        asks for another.
        """
        if is_editing(context):  # it may come back to what it was
            return True
        own = [city for city in list_cities(context.scene) if Session.of(city) is self._shown]
        return bool(own) and city_design.describe_edited(own[0]) == self._asked

    def drop(self):
        """Forget that it was tried: redo may ask for it again."""
        UpdateCity.tried = None

    def refine(self, context):
        """Show the hours estimated from the annual light."""
        switched = Session.of(find_city(context.scene)[0]) is not self._shown
        if self._found.empty() or switched or is_editing(context):
            return
        draft, seen, hours = self._found.get()
        city, ground = self._shown.find_city(context.scene)
        self._keep_before(context, city, ground)
        ids, known = (
            self._shown.transfer.surfaces.surface_id,
            np.asarray(self._shown.energy.full_load_hours),
        )
        earlier = known - values_of_surfaces(city, CHANGE + HOURS, len(ids), missing=0.0)
        show_kinds(context, self._shown, draft, [], seen)
        self._shown = draft
        city, ground = draft.find_city(context.scene)
        before = dict(zip(ids, earlier.tolist(), strict=True))
        change = hours - [before.get(name, np.nan) for name in draft.scene.surfaces.surface_id]
        city[Key.REDESIGNED], city[Key.PREVIEW] = True, "an estimate; exact numbers follow"
        faces = Faces(city, ground)
        faces.write_values(HOURS, hours)
        faces.write_values(CHANGE + HOURS, change)
        show_result(context, city, ground, CHANGE + HOURS)
        redraw_panels(context, views=True)

    def _keep_before(self, context, city, ground):
        if find_before(context.scene, city) is None and Session.of(city).energy is not None:
            KeepBefore.act(self, context, city, ground)

    def finish(self, context, result):
        """Keep the result before the first edit, and show the edited city with what it gains or
        loses.
        """
        seen, known, earlier, known.change = result
        city, ground = self._shown.find_city(context.scene)
        self._keep_before(context, city, ground)
        again = _renew_before(find_before(context.scene, city), earlier) if earlier else ""
        traced, (_, *energy) = known.cached
        show_kinds(context, self._shown, known, traced[2], seen)
        keep_light(context, *traced)
        UpdateCity.tried = None
        text = WeighEnergy.finish(self, context, (known, *energy))
        find_city(context.scene)[0].pop(Key.PREVIEW, None)
        return text + again


def estimate_hours(session, scene, light):
    """Full load hours of an edited city before its suns are solved, from light under the sky and
    all suns together.

    Hours follow light closely: hours before, and the change of light by what light is worth in this
    city.

    Parameters
    ----------
    session : Session
        Before the edit, with its energy.
    scene : core.city.scene.Scene
        n surfaces of the edited city.
    light : tuple of two (n,) float64
        Of its surfaces, per DHI and per DNI, of `core.light.change_light`.

    Returns
    -------
    (n,) float64 [h]
        NaN for surfaces that carry no modules.
    """
    hours = np.array(session.energy.full_load_hours)
    before = session.base.city.states[0].of_surfaces[session.base.rows]
    known = np.isfinite(hours)
    worth = np.linalg.lstsq(before[known], hours[known], rcond=None)[0]
    row = {name: place for place, name in enumerate(session.transfer.surfaces.surface_id)}
    rows = np.array([row.get(name, -1) for name in scene.surfaces.surface_id])
    rest = np.append(hours - before @ worth, 0.0)[rows]
    guess = np.column_stack(light) @ worth + rest
    return np.where((rows < 0) & ~scene.surfaces.eligible, np.nan, np.maximum(guess, 0.0))


def _match_before(before, after, solved, progress):
    """What is kept as before with the reflections and the sky of an edited city, and its energy, if
    it has others.

    Parameters
    ----------
    before, after : Session
        The latter with what was found of it.
    solved : EditableCity or None
        The city before with these, if it is known already.
    progress : callable

    Returns
    -------
    Session or None
    """
    from ...core.light.match_light import match_light
    from ...core.run.study import compute_energy

    if before.base is None or after.base is None:
        return None
    wanted = after.base.decisions
    base = solved or match_light(before.base, wanted.plan["sky"], wanted.bounces, progress)
    if base is before.base:
        return None
    _, _, weather, _, request, _ = after.cached[1]
    energy = compute_energy(base.transfer, weather, request)
    return replace(before, base=base, transfer=base.transfer, energy=energy)


def _renew_before(item, earlier):
    """Show on what was kept as before, and keep in its session, the hours of its city with other
    light: what to say.
    """
    from ...core.results.compare_runs import describe_light

    session = Session.of(item)
    if item is None or session is None or item.get(Key.PART) != "before":
        return ""  # a variant that is shown itself keeps its hours
    Faces(item).write_results(earlier.transfer, earlier.energy)
    session.base, session.transfer, session.energy = earlier.base, earlier.transfer, earlier.energy
    light = {
        "max_bounces": earlier.base.decisions.bounces,
        "sky": earlier.base.decisions.plan["sky"],
    }
    return f"; before has the light that this city asks for: {describe_light(light)}"


def is_editing(context):
    """Whether the user is in the middle of an edit: moving something, or in edit mode."""
    # Operators that end with the mouse released.
    busy = any(
        own.bl_idname.startswith(("TRANSFORM_OT_", "OBJECT_OT_", "MESH_OT_"))
        for own in context.window.modal_operators
    )
    return busy or context.mode not in ("OBJECT", "POSE")


def tell_errors(before, after, weather, energy, request):
    """Standard errors of the change of full load hours, whose noise before and after cancels.

    Parameters
    ----------
    before, after : EditableCity or None
        The latter of an edit of the former.
    weather : core.weather.weather.Weather
    energy : core.energy.energy.Energy
        Of the city after.
    request : core.settings.request.Request

    Returns
    -------
    tuple of EditableCity, dict, or None
        As `before`, and the errors [h] by surface_id.
    """
    from ...core.run.variant import errors_of_change

    if before is None or after is None or before is after:
        return None
    surface_id, errors = errors_of_change(before, after, weather, request, energy)
    return before, dict(zip(surface_id, errors.tolist(), strict=True))
