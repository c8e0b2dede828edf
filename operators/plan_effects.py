"""Plan: what a trace would simulate of the city, and why, without tracing it."""

import bpy

from .attributes import PREFIX
from .compile_loops import compile_loops
from .read_settings import read_settings
from .run_step import Step
from .session import find_city, find_own_city, find_session

PLAN = PREFIX + "plan"  # property of the city


class OfScene:
    """Base of operators that need a classified city of this session."""

    @classmethod
    def poll(cls, context):
        """The city has been classified in this session."""
        cls.poll_message_set("Classify the city first")
        session = find_session(find_city(context.scene)[0])
        return session is not None and session.scene is not None

    def prepare(self, context):
        """Take the scene and the settings."""
        return find_session(find_city(context.scene)[0]), read_settings(context.scene.citypv)


class PlanEffects(OfScene, Step, bpy.types.Operator):
    """Decide which effects this city calls for, each with its reason, what it leaves out at most, and its seconds"""

    bl_idname = "citypv.plan_effects"
    bl_label = "Plan effects"
    bl_options = {"REGISTER", "UNDO"}

    @staticmethod
    def work(task, progress):
        """Decide, with a pilot where a decision depends on it."""
        from ..core.study import check_settings, prepare_study, read_year

        session, request = task
        check_settings(request)
        compile_loops(progress)
        progress("reading weather", 0, 1, "years")
        weather = read_year(session.scene.site, request)
        prepared = prepare_study(session.scene, weather, request, progress=progress)
        return session, [effect.as_dict() for effect in prepared.plan.effects]

    def finish(self, context, result):
        """Store the decisions on the city."""
        session, decisions = result
        city, _ = find_own_city(context.scene, session)
        keep_plan(city, decisions)
        return f"{sum(one['on'] for one in decisions)} of {len(decisions)} effects are on"


class ExplainEffect(bpy.types.Operator):
    """Why an effect is on or off"""

    bl_idname = "citypv.explain_effect"
    bl_label = "Explain effect"
    bl_options = {"REGISTER", "INTERNAL"}

    effect: bpy.props.StringProperty(name="Effect", description="Its key")

    @classmethod
    def poll(cls, context):
        """The effects are planned."""
        cls.poll_message_set("Plan the effects first")
        city, _ = find_city(context.scene)
        return city is not None and PLAN in city

    @classmethod
    def description(cls, context, properties):
        """Tooltip: the decision."""
        return read_plan(find_city(context.scene)[0]).get(properties.effect, ("", cls.__doc__))[1]

    def execute(self, context):
        """Tell the decision."""
        plan = read_plan(find_city(context.scene)[0])
        if self.effect not in plan:
            self.report({"ERROR"}, f"{self.effect!r} is no effect; give one of {', '.join(plan)}")
            return {"CANCELLED"}
        self.report({"INFO"}, f"{self.effect}: {plan[self.effect][1]}")
        return {"FINISHED"}


def keep_plan(city, decisions):
    """Store decisions on a city: for each effect its key, on or off with its extent, and a sentence.

    Parameters
    ----------
    city : bpy.types.Object
    decisions : list of dict
        Of `core.effects.effect.Effect.as_dict`.
    """
    city[PLAN] = [
        "|".join(text.replace("|", "/") for text in (one["key"], describe_state(one), describe_decision(one)))
        for one in decisions
    ]


def read_plan(city):
    """Decisions on the effects of a city: dict of key to (state, sentence); empty without a plan."""
    rows = city.get(PLAN, ()) if city is not None else ()
    return {key: (state, sentence) for key, state, sentence in (row.split("|") for row in rows)}


def describe_state(decision):
    """Whether and how far an effect is simulated, in a few words."""
    return f"{'on' if decision['on'] else 'off'}: {decision['extent']}"


def describe_decision(decision):
    """Reason, bound, share and seconds of a decision in one sentence."""
    bound = "no bound on its error is known" if decision["on"] else "how much light this changes is not known"
    if decision["bound"] is not None:
        bound = f"leaves out at most {100 * decision['bound']:.2g} % of full load hours"
    parts = [f"{decision['extent']}: {decision['reason']}", bound]
    if decision["share"] is not None:
        parts.append(f"makes {100 * decision['share']:+.1f} % of them")
    if decision["seconds"] is not None:
        parts.append(f"takes about {decision['seconds']:.2g} s")
    return "; ".join(parts)
