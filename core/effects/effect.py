"""One decision of the plan, and what it is made from."""

from dataclasses import dataclass, field, fields
from typing import Any

from ..patches.patches import Patches
from ..request import Request
from ..scene.scene import Scene


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
    decided: dict = field(default_factory=dict)  # key -> Effect, of the lines of the table above this one

    def asked(self, key, default=None):
        """Whether the user has switched an effect on or off; `default` if neither."""
        return self.request.effects.get(key, default)
