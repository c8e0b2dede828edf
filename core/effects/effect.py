"""One decision of the plan, what all of them together mean for tracing, and what they are made
from.
"""

import math
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property

import numpy as np

from ..city.scene import Scene
from ..patches.facing_scene import FacingScene
from ..patches.patches import Patches
from ..patches.read_albedo import TriangleBrdfs
from ..settings.errors import show_number
from ..settings.progress import describe_duration
from ..settings.request import Request
from ..sky.horizon import TerrainHorizon, is_above
from ..sky.read_horizon import read_horizon
from ..sky.sky_models import RAYS_SHARE, sources_of
from ..sun.solar_position import MINIMUM_ELEVATION
from ..sun.suns import Suns
from ..weather.weather import Weather
from .foliage import Foliage
from .table import TABLE

NO_SUNS = np.zeros((0, 3), np.float32)


@dataclass
class Effect:
    """Whether and how far one effect is simulated."""

    key: str
    on: bool
    extent: str  # how far it goes: "3 bounces", "812 of 20,133 patches"
    reason: str
    # share of full load hours that is left out at most; None: not known before the run
    bound: float | None
    seconds: float | None = None  # predicted cost [s]; None: not known
    # after the run: what it left out as measured, and whether the bound holds
    outcome: dict | None = None
    share: float | None = None  # of full load hours that the effect adds or takes; None: not known
    share_standard_error: float | None = None


@dataclass
class TracePlan:
    """What will be traced: what each rule decides for the estimators, and in words; `plan[key]` is
    an Effect.
    """

    effects: list = field(default_factory=list)  # of Effect, in the order of the table
    # sentences for the user on settings that mean nothing any more
    notes: list = field(default_factory=list)
    ray_scene: FacingScene | None = None  # if it was made already
    foliage: Foliage | None = None  # None: no tree is traced
    unobstructed: np.ndarray | None = None  # (p,) bool, patches that see the sky in closed form
    open_to_suns: np.ndarray | None = None  # (p,) bool, patches that see every sun in front of them
    # whether shadow rays are sent to suns behind a patch, to see that this changes nothing
    suns_behind: bool = False
    terrain: TerrainHorizon | None = None  # of distant terrain; None where it is level
    # (k, 3) float32, never above the terrain: not traced
    hidden_suns: np.ndarray = field(default_factory=NO_SUNS.copy)
    receivers: np.ndarray | None = None  # (p,) bool, patches that get all rays; None: all
    max_bounces: int | None = 0  # number of reflections; None: until what is left is small
    # whether shade moves over strings, so that what they lose is found; None: it stays unknown
    string_shade: bool | None = None
    far_ground: bool = False  # whether rays that leave downwards meet lit ground
    reach: float = np.inf  # how far away it begins, in building heights
    sky: str = "isotropic"  # model of the sky
    # hemisphere rays for each ray towards a source of light in the sky
    rays_share: int = RAYS_SHARE
    # of what photons follow; None: every face reflects by Lambert's law, or is black
    brdfs: TriangleBrdfs | None = None

    def __getitem__(self, key):
        return next(effect for effect in self.effects if effect.key == key)

    @property
    def reflections(self) -> bool:
        """Whether the matrix of form factors is needed."""
        return self.max_bounces != 0

    @property
    def sources(self) -> tuple:
        """Sources of light in the sky that are traced beside its dome: of HorizonBand."""
        return sources_of(self.sky)

    def without_hidden(self, suns):
        """Suns without weight where they stand behind the distant terrain: the weights sum to the
        share of open suns.
        """
        if self.terrain is None:
            return suns
        above = is_above(self.terrain, suns.direction)
        return replace(suns, weight=np.where(above, suns.weight, 0.0))

    def lit(self, directions):
        """Which suns, (s, 3) float32, are traced: all but those behind the terrain in all that they
        represent.
        """
        return ~(directions[:, None] == self.hidden_suns).all(axis=2).any(axis=1)

    def judge(self, measured):
        """Effects after a run, with an outcome where the run itself knows what was left out.

        Light falls by the same factor from reflection to reflection, so that the last one tells
        what lies beyond.

        Parameters
        ----------
        measured : Measured

        Returns
        -------
        list of dict
            Fields of Effect by name.
        """
        hidden = (
            1 - np.cos(np.arctan2(1.0, self.reach))
        ) / 2  # of the sky, from where the far ground begins
        left_out = {
            "receivers": measured.passed_on,
            "far-ground": float(measured.far_ground * hidden),
        }
        if measured.beyond is not None:
            left_out["reflections"] = measured.beyond
        elif self.max_bounces and measured.last_bounce < 1:
            factor = measured.last_bounce ** (1 / self.max_bounces)
            left_out["reflections"] = measured.last_bounce * factor / (1 - factor)
        for effect in self.effects:
            outcome = 0.0 if effect.bound == 0 else left_out.get(effect.key) if effect.on else None
            holds = None if None in (outcome, effect.bound) else bool(outcome <= effect.bound)
            effect.outcome = None if outcome is None else {"left_out": outcome, "holds": holds}
        return [asdict(effect) for effect in self.effects]

    def names(self):
        """What is simulated and what is not, in one line; `describe` says why."""
        on, off = (
            ", ".join(TABLE[effect.key].title for effect in self.effects if effect.on == wanted)
            for wanted in (True, False)
        )
        return f"Simulated: {on}; not called for: {off or 'none'} (--verbose tells why)"

    def describe(self):
        """The plan and its notes in lines of text."""
        lines = []
        for effect in self.effects:
            words = [describe_bound(effect.bound, effect.on)]
            if effect.share is not None:
                # [%] no error is told as 0.00
                error = math.ceil(1e4 * (effect.share_standard_error or 0)) / 100
                doubt = f" ± {error:.2f}" if error else ""
                words.append(
                    f"contributes {show_number(100 * effect.share, 2, plus=True)}{doubt} % of full "
                    "load hours"
                )
            if effect.seconds is not None:
                verb = "takes" if effect.seconds >= 0 else "saves"
                words.append(f"{verb} {describe_duration(abs(effect.seconds))}")
            state = "on " if effect.on else "off"
            lines.append(
                f"{effect.key:<15} {state}  {effect.extent}: {effect.reason} ({'; '.join(words)})"
            )
        return lines + self.notes


@dataclass
class Inputs:
    """What decisions are made from."""

    scene: Scene  # with the backs of sheets
    patches: Patches
    materials: list  # of patches.read_albedo.Found
    request: Request
    weather: Weather | None = None  # where it is known
    suns: Suns | None = None  # where they are known
    # with the decisions of the lines of the table above
    plan: TracePlan = field(default_factory=TracePlan)

    def asked(self, key, default=None):
        """Whether the user has switched an effect on or off; `default` if neither."""
        return self.request.effects.get(key, default)

    @cached_property
    def horizons(self):
        """Horizon of the terrain as seen from the site, and from the corners of the scene; None
        where none is given.
        """
        path = self.request.horizon
        return None if path is None else read_horizon(path, self.scene)

    @property
    def terrain(self):
        """Horizon that hides suns and sky; None where it is level, too low to count, or switched
        off.
        """
        if self.horizons is None:
            return None
        horizon = self.horizons[0]
        return (
            horizon
            if self.asked("terrain-horizon", horizon.elevation.max() > MINIMUM_ELEVATION)
            else None
        )

    @cached_property
    def unshaded(self) -> bool:
        """Whether every receiver is in closed form: then only the far ground reflects onto it,
        once.
        """
        wanted = np.append(counted_surfaces(self.scene.surfaces), False)
        receivers = wanted[self.scene.triangle_surface] & self.patches.receives
        return bool(self.plan.unobstructed[receivers].all())


def counted_surfaces(surfaces):
    """Surfaces whose light counts: the eligible ones, or all where none is: (n,) bool."""
    return np.asarray(
        surfaces.eligible if surfaces.eligible.any() else np.ones(len(surfaces), bool), bool
    )


@dataclass
class Measured:
    """What a run tells on what it left out, as shares of light."""

    last_bounce: float  # share of the last reflection
    far_ground: float  # share of the far ground, reflected once
    # standard error from light that others pass on, in the mean of the worst group
    passed_on: float = 0.0
    # share of light that would be reflected more often; None: as the last one tells
    beyond: float | None = None


def describe_bound(bound, on):
    """What is left out at most, a share of light or None, in words."""
    if bound is None:
        return f"{'its error' if on else 'how much light this changes'} is not known before the run"
    return f"leaves out at most {100 * bound:.2f} %" if bound else "leaves out nothing"
