"""Which effects a scene calls for, decided before the first ray, each with a reason and a bound."""

from dataclasses import dataclass

import numpy as np

from ..patches.facing_scene import FacingScene
from ..progress import silent
from ..sky.light_sources import sources_of
from .effect import Effect, Inputs
from .pilot import Pilot
from .switched_off import BOUNDED, JUDGED, SURPLUS, bound_off, is_left_out, is_switched_off
from .table import PLANNING, TABLE, check_effects, check_needs, decide_effect


@dataclass
class EffectPlan:
    """What will be traced: `plan[key]` is the Effect of a key."""

    effects: list[Effect]  # in the order of the table
    ray_scene: FacingScene | None = None  # if the pilot made one
    pilot: Pilot | None = None  # if it was traced
    inputs: Inputs | None = None  # if what effects leave out is to be measured by paths after the run
    lit_years: list | None = None  # of reflections.Lit, if paths were lit by plausible years

    def __getitem__(self, key):
        return next(effect for effect in self.effects if effect.key == key)

    @property
    def unobstructed(self) -> np.ndarray:
        """Patches that see the sky in closed form: (p,) bool."""
        return self["sky-rays"].setting

    @property
    def open_to_suns(self) -> np.ndarray:
        """Patches that see every sun in front of them: (p,) bool."""
        return self["shadow-rays"].setting.unobstructed

    @property
    def receivers(self) -> np.ndarray | None:
        """Patches that get all rays: (p,) bool; None: all."""
        return self["receivers"].setting

    @property
    def max_bounces(self) -> int | None:
        """Number of reflections; None: until what is left of the light is small."""
        return self["reflections"].setting

    @property
    def reflections(self) -> bool:
        """Whether the matrix of form factors is needed."""
        return self.max_bounces != 0

    @property
    def reflectors(self) -> bool:
        """Whether ground that no surface sees is left out."""
        return self["reflectors"].on

    @property
    def far_ground(self) -> bool:
        """Whether rays that leave downwards meet lit ground."""
        return self["far-ground"].on

    @property
    def sources(self) -> tuple:
        """Sources of light in the sky that are traced beside its dome: of SkySource."""
        return sources_of(self["perez"].setting.model)

    @property
    def rays_share(self) -> int:
        """Hemisphere rays for each ray towards a source."""
        return self["perez"].setting.rays_share

    @property
    def terrain(self):
        """Horizon of distant terrain, or None where it is level."""
        known = self["terrain-horizon"].setting
        return known and known.horizon

    def lit(self, directions):
        """Which suns, (s, 3) float32, are traced: all but those behind the terrain in all that they represent."""
        known = self["terrain-horizon"].setting
        if known is None or not len(known.hidden):
            return np.ones(len(directions), bool)
        return ~(directions[:, None] == known.hidden).all(axis=2).any(axis=1)

    @property
    def suns_behind(self) -> bool:
        """Whether shadow rays are sent to suns behind a patch."""
        return self["shadow-rays"].setting.behind


def plan_effects(scene, patches, request, *, materials=(), weather=None, suns=None, measure=False, progress=silent):
    """Decide what to trace.

    Parameters
    ----------
    scene : Scene
    patches : Patches
    request : Request
    materials : list, optional
        Of `materials.read_albedo.Found`.
    weather : Weather, optional
    suns : Suns, optional
    measure : bool
        Trace the pilot even where no decision depends on it, to state shares and tighter bounds.
    progress : callable, optional
        See `core.progress`: effects decided.

    Returns
    -------
    EffectPlan

    Raises
    ------
    InputError
        If `request.effects` names an effect that does not exist or that lacks what it needs, or an array of the scene
        cannot be used.
    """
    check_effects(request)
    check_needs(request)
    inputs = Inputs(scene, patches, materials, request, weather, suns, measure)
    for done, key in enumerate(TABLE):
        progress(PLANNING, done, len(TABLE), "effects")
        inputs.decided[key] = decide_effect(key, inputs)
    off = [key for key in JUDGED if measure and weather is not None and is_switched_off(inputs, key)]
    for key in off:
        if key in BOUNDED:
            inputs.decided[key].bound = bound_off(inputs, key)
    made = vars(inputs)
    judged = inputs if measure and weather is not None and any(is_left_out(inputs, key) for key in JUDGED) else None
    return EffectPlan(list(inputs.decided.values()), made.get("ray_scene"), made.get("pilot"), judged, inputs.lit_years)


def describe_plan(plan):
    """The plan in lines of text."""
    lines = []
    for effect in plan.effects:
        bound = describe_bound(effect.bound, effect.on)
        if effect.key in SURPLUS and not effect.on and effect.bound:
            bound = f"finds at most {100 * effect.bound:.2f} % too much light"
        share = "" if effect.share is None else f"; contributes {100 * effect.share:+.2f} % of full load hours"
        seconds = "" if effect.seconds is None else f"; takes about {effect.seconds:.2g} s"
        state = "on " if effect.on else "off"
        lines.append(f"{effect.key:<15} {state}  {effect.extent}: {effect.reason} ({bound}{share}{seconds})")
    return lines


def describe_bound(bound, on):
    """What is left out at most, a share of light or None, in words."""
    if bound is None:
        return "no bound on its error is known" if on else "how much light this changes is not known"
    return f"leaves out at most {100 * bound:.2f} %" if bound else "leaves out nothing"
