"""What a trace will simulate and cost: the plan of effects with its reasons, and the prices of the
presets.
"""

from dataclasses import asdict
from math import isfinite

import bpy

from ...core.settings.errors import InputError, show_number
from ...core.settings.presets import PRESET_WORDS, PRESETS
from ...core.settings.progress import describe_duration
from ...core.settings.request import Request
from ..city.declare_settings import UNSET
from ..city.edit_marks import check_unedited
from ..city.keys import Key
from ..city.panel import StepPanel
from ..city.preferences import folder_of_answers
from ..city.read_settings import read_settings
from ..city.run_step import Action, OfCity, Step
from ..city.session import Session, find_city
from .compile_loops import compile_loops

ITEMS = [(name, name.capitalize(), words) for name, words in PRESET_WORDS.items()]


class OfScene(OfCity):
    """Base of steps that need a classified city of this session."""

    needs, lacking = "scene", "Classify the city first"

    def prepare(self, context):
        """Take the scene and the settings."""
        city, _ = find_city(context.scene)
        check_unedited(city)
        return Session.of(city), read_settings(context.scene.citypv)


def prepare_weather(session, request, progress):
    """Weather of a session's place in a year, once settings are checked and loops are compiled:
    Weather.
    """
    from ...core.run.study import check_settings, read_year

    check_settings(request)
    compile_loops(progress)
    progress("reading weather", 0, 1, "years")
    return read_year(session.scene.site, request, keep=(folder_of_answers(),))


class PlanEffects(OfScene, Step, bpy.types.Operator):
    """Decide which effects this city calls for: reasons, what each leaves out, seconds"""

    bl_idname, bl_label = "citypv.plan_effects", "Plan effects"

    @staticmethod
    def work(task, progress):
        """Decide, with a pilot where a decision depends on it."""
        from ...core.run.study import prepare_study

        session, request = task
        weather = prepare_weather(session, request, progress)
        prepared = prepare_study(session.scene, weather, request, progress=progress)
        return session, [asdict(effect) for effect in prepared.plan.effects]

    def finish(self, context, result):
        """Store the decisions on the city."""
        session, decisions = result
        city, _ = session.find_city(context.scene)
        keep_plan(city, decisions)
        return f"{sum(decision['on'] for decision in decisions)} of {len(decisions)} effects are on"


class ExplainEffect(OfCity, Action, bpy.types.Operator):
    """Why an effect is on or off"""

    bl_idname, bl_label = "citypv.explain_effect", "Explain effect"
    bl_options = {"REGISTER", "INTERNAL"}
    needs, lacking = Key.PLANNED, "Plan the effects first"

    effect: bpy.props.StringProperty(name="Effect", description="Its key")

    @classmethod
    def description(cls, context, properties):
        """Tooltip: the decision."""
        return read_plan(find_city(context.scene)[0] or {}).get(
            properties.effect, ("", cls.__doc__)
        )[1]

    def act(self, context, city, ground):
        """Tell the decision."""
        plan = read_plan(city)
        if self.effect not in plan:
            raise InputError(
                "Effect", f"{self.effect!r} is no effect", f"give one of {', '.join(plan)}"
            )
        return f"{self.effect}: {plan[self.effect][1]}"


def keep_plan(city, decisions):
    """Store decisions on a city: for each effect on or off with its extent, and a sentence.

    Parameters
    ----------
    city : bpy.types.Object
    decisions : list of dict
        Of `core.effects.effect.Effect.as_dict`.
    """
    from ...core.effects.effect import describe_bound

    plan = {}
    for decision in decisions:
        parts = [
            f"{decision['extent']}: {decision['reason']}",
            describe_bound(decision["bound"], decision["on"]),
        ]
        if decision["share"] is not None:
            parts.append(
                f"makes {show_number(100 * decision['share'], 1, plus=True)} % of full load hours"
            )
        if decision["seconds"] is not None:
            parts.append(f"takes {describe_duration(decision['seconds'])}")
        plan[decision["key"]] = [
            f"{'on' if decision['on'] else 'off'}: {decision['extent']}",
            "; ".join(parts),
        ]
    city[Key.PLANNED] = plan


def read_plan(city):
    """Decisions on the effects of a city: mapping of key to (state, sentence); empty without a
    plan.
    """
    return city.get(Key.PLANNED) or {}


class UsePreset(Action, bpy.types.Operator):
    """Set rays, suns and patches for a purpose"""

    bl_idname, bl_label = "citypv.use_preset", "Use preset"

    preset: bpy.props.EnumProperty(
        name="Preset", description="Settings of Trace", items=ITEMS, default="standard"
    )

    @classmethod
    def description(cls, context, properties):
        """Tooltip: what the preset is for."""
        return PRESET_WORDS[properties.preset]

    def act(self, context, city, ground):
        """Set them."""
        for name, value in _properties_of_preset(self.preset).items():
            setattr(context.scene.citypv, name, value)
        return f"{self.preset.capitalize()}: {PRESET_WORDS[self.preset]}"


class PredictPrices(OfScene, Step, bpy.types.Operator):
    """Predict seconds and error of each preset on this city, from a pilot of some seconds"""

    bl_idname, bl_label = "citypv.predict", "Predict time and error"

    @staticmethod
    def work(task, progress):
        """Trace the pilot."""
        from ...core.accuracy.cost_curve import predict_costs

        session, request = task
        weather = prepare_weather(session, request, progress)
        listed = predict_costs(session.scene, weather, request, progress=progress)
        return session, {
            prediction.name: [prediction.seconds, prediction.error]
            for prediction in listed.prices
            if prediction.name in PRESETS
        }

    def finish(self, context, result):
        """Store the predictions on the city."""
        session, prices = result
        city, _ = session.find_city(context.scene)
        city[Key.PREDICTED] = prices
        return "; ".join(
            f"{name.capitalize()}: {_describe_prediction(prediction)}"
            for name, prediction in prices.items()
        )


def _properties_of_preset(preset):
    """Values of the panel's properties of a preset: dict; what it does not name is the program's
    default.
    """
    named = sorted({name for settings in PRESETS.values() for name in settings})
    chosen = {name: PRESETS[preset].get(name, getattr(Request(), name)) for name in named}
    way, _, number = chosen.pop("suns").partition(":")
    properties = {name: UNSET if value is None else value for name, value in chosen.items()}
    return properties | {"suns": way, way.replace("-", "_"): int(number)}


def find_preset(settings):
    """Preset that has the panel's settings: str, "" if none has."""
    shown = {name: _properties_of_preset(name).items() for name in PRESETS}
    return next(
        (
            name
            for name, row in shown.items()
            if all(getattr(settings, key) == one for key, one in row)
        ),
        "",
    )


def _describe_prediction(prediction):
    """Seconds and error in a few words."""
    seconds, error = prediction
    time = describe_duration(seconds)
    return f"{time}, ± {error:.2g} %" if isfinite(error) else time  # NaN where nothing is eligible


class TracePanel(StepPanel, bpy.types.Panel):
    """Trace."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_trace", "3  Trace", 6

    def draw(self, context):
        """Show the settings of the step."""
        column, settings, city = self.start(context)
        _draw_presets(column, city, settings)
        self.draw_running("Predict time and error")
        number = () if settings.suns == "hourly" else (settings.suns.replace("-", "_"),)
        file = ("albedo_file",) if settings.albedo_source == "file" else ()
        names = "suns", *number, *self.list_settings("trace"), "albedo_source", *file, "horizon"
        self.draw_settings(column, settings, *names)
        sampling = self.open_part(column, "citypv_sampling", "Sampling")
        if sampling:
            self.draw_settings(sampling, settings, *self.list_settings("sampling"), "threads")
        effects = self.open_part(column, "citypv_effects", "Effects")
        if effects:
            self.draw_effects(effects, city, settings, electric=False)
            effects.operator("citypv.plan_effects", icon="PRESET")
        self.draw_running("Plan effects")
        seeing = context.scene.citypv_seeing
        self.draw_settings(
            column, seeing, "refine", *(("target_error", "time_budget") if seeing.refine else ())
        )
        self.draw_step(column, "citypv.trace", "LIGHT_SUN")
        self.draw_table(city, "citypv_albedos", ("Material", "Albedo", "Surfaces"))
        self.draw_told(self.layout, city.get("citypv_unread"))


def _draw_presets(layout, city, settings):
    """Show a button for each preset and, once predicted, its seconds and error; bars show the
    error.
    """
    prices, active = city.get(Key.PREDICTED) or {}, find_preset(settings)
    row = layout.row(align=True)
    for name, title, _ in ITEMS:
        row.operator("citypv.use_preset", text=title, depress=name == active).preset = name
    largest = max((error for _, error in prices.values() if isfinite(error)), default=0.0)
    for name, title, _ in ITEMS if prices else ():
        line = layout.split(factor=0.3)
        line.label(text=title)
        error = prices[name][1]
        line.progress(
            factor=error / largest if largest and isfinite(error) else 0.0,
            text=_describe_prediction(prices[name]),
        )
    layout.operator("citypv.predict", icon="TIME")
