"""One decision of the plan, and what it is made from."""

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from ..horizon.read_horizon import read_horizon
from ..patches.facing_scene import FacingScene
from ..patches.patches import Patches
from ..scene.scene import Scene
from ..settings.request import Request
from ..settings.threads import usable_threads
from ..sun.solar_position import MINIMUM_ELEVATION
from .pilot import Pilot, Surroundings, trace_pilot


@dataclass
class Effect:
    """Whether and how far one effect is simulated."""

    key: str
    on: bool
    extent: str  # how far it goes: "3 bounces", "812 of 20,133 patches"
    reason: str
    bound: float | None  # share of full load hours that is left out at most; None: no bound is known
    setting: Any = None  # what the estimator needs to know, of any type
    seconds: float | None = None  # predicted cost [s]; None: not known
    outcome: dict | None = None  # after the run: what it left out as measured, and whether the bound holds
    share: float | None = None  # of full load hours that the effect adds or takes, expected; None: not known

    def as_dict(self):
        """All but `setting`, which may be an array, by name."""
        return {one.name: getattr(self, one.name) for one in fields(self) if one.name != "setting"}


@dataclass
class Inputs:
    """What decisions are made from."""

    scene: Scene  # with the backs of sheets
    patches: Patches
    materials: list  # of materials.read_albedo.Found
    request: Request
    weather: Any = None  # weather.Weather, where it is known
    suns: Any = None  # sun.Suns, where they are known
    measure: bool = False  # whether the pilot may be traced where no decision depends on it
    lit_years: Any = None  # list of reflections.Lit, once they have been looked at
    decided: dict = field(default_factory=dict)  # key -> Effect, of the lines of the table above this one

    def asked(self, key, default=None):
        """Whether the user has switched an effect on or off; `default` if neither."""
        return self.request.effects.get(key, default)

    @cached_property
    def ray_scene(self) -> FacingScene:
        """Triangles for tracing rays, made when an effect needs them."""
        return FacingScene(self.scene, self.patches, usable_threads(self.request.threads))

    @cached_property
    def horizons(self):
        """Horizon of the terrain as seen from the site, and from the corners of the scene; None where none is given."""
        path = self.request.horizon
        return None if path is None else read_horizon(path, self.scene)

    @property
    def terrain(self):
        """Horizon that hides suns and sky; None where it is level, too low to count, or switched off."""
        if self.horizons is None:
            return None
        horizon = self.horizons[0]
        return horizon if self.asked("terrain-horizon", horizon.elevation.max() > MINIMUM_ELEVATION) else None

    @property
    def far_ground_albedo(self) -> float:
        """Albedo of the far ground; 0 where it is switched off."""
        return self.request.ground_albedo if self.asked("far-ground", self.request.far_ground) else 0.0

    @cached_property
    def pilot(self) -> Pilot | None:
        """Where the light of the receivers comes from, traced when an effect needs it."""
        foliage = self.decided["trees"].setting
        around = Surroundings(self.far_ground_albedo, self.suns, foliage and foliage.canopy(bare=True), self.terrain)
        return trace_pilot(self.ray_scene, self.patches, self.scene, around, self.request.seed)

    @property
    def pilot_if_wanted(self) -> Pilot | None:
        """The pilot if it has been traced, or may be traced; else None. None where nothing shades the receivers."""
        if self.unshaded:
            return None
        return self.pilot if self.measure or self.lit_years is not None or "pilot" in self.__dict__ else None

    @cached_property
    def unshaded(self) -> bool:
        """Whether every receiver is in closed form: then only the far ground reflects onto it, once."""
        surfaces = self.scene.surfaces
        wanted = np.append(surfaces.eligible if surfaces.eligible.any() else np.ones(len(surfaces), bool), False)
        receivers = wanted[self.scene.triangle_surface] & self.patches.receives
        return bool(self.decided["sky-rays"].setting[receivers].all())

    @property
    def direct_over_diffuse(self) -> float:
        """Direct normal over diffuse irradiance of the year; 1 if the weather is not known."""
        if self.weather is None:
            return 1.0
        diffuse = float(self.weather.data["dhi"].sum())
        return float(self.weather.data["dni"].sum()) / diffuse if diffuse > 0 else 1.0
