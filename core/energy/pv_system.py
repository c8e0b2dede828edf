"""The PV system: modules, mounting, losses, inverter, and the area that carries modules."""

from dataclasses import dataclass, field

import pvlib

from ..settings.errors import InputError
from .pick_inverter import Inverter, pick_inverter
from .pick_module import CEC, SANDIA, Module, pick_module

MOUNTINGS = {  # Sandia's thermal parameters (King et al. 2004, table 1) as pvlib names them
    "open-rack": "open_rack_glass_polymer",
    "insulated-back": "insulated_back_glass_polymer",
    "close-mount": "close_mount_glass_glass",
}
OF_LIBRARY = {SANDIA: "sapm", CEC: "physical"}  # library -> law of "module"
ELECTRIC = ("aoi", "spectrum", "temperature")  # effects that may be switched off
BEARING = ("facade", "roof", "flat", "rack")  # kinds that --usable may name
MODULE = "SunPower_SPR_300_WHT__2007__E__"  # the paper's


@dataclass(frozen=True)
class PvSystem:
    """Modules, their mounting, the losses up to the grid, and the counted area."""

    module: Module
    mounting: str = "open-rack"
    incidence: str = "sapm"  # incidence angle modifier: sapm, physical, ashrae
    diffuse_incidence: bool = False  # whether diffuse light has an incidence angle modifier, too
    losses: float = 0.0  # [%] of DC energy: soiling, mismatch, wiring …
    inverter: Inverter | None = None
    hidden_walls: str = "leave-out"  # or count: whether covered area carries modules
    overhangs: bool = False  # whether walls that lean outward by more than 1° are facades, as in the paper
    usable: dict = field(default_factory=dict)  # kind -> share of its area without windows and edges
    aoi: bool = True  # whether light that falls in at an angle is lost to reflection by the glass
    spectrum: bool = True  # whether the current depends on the spectrum
    temperature: bool = True  # whether cells are as warm as air and light make them, or always at 25 °C

    @property
    def feeds_grid(self):
        """Whether AC energy is computed: with losses or an inverter."""
        return self.losses > 0 or self.inverter is not None

    @property
    def thermal(self):
        """Parameters a, b and deltaT of Sandia's cell temperature."""
        return pvlib.temperature.TEMPERATURE_MODEL_PARAMETERS["sapm"][MOUNTINGS[self.mounting]]


def build_system(request):
    """Build the system from the settings.

    Parameters
    ----------
    request : Request
        Checked by `check_request`.

    Returns
    -------
    PvSystem

    Raises
    ------
    InputError
        If a usable share is invalid, or no module or inverter matches the name.
    """
    check_usable(request.usable)
    module = pick_module(request.module)
    return PvSystem(
        module,
        mounting=request.mounting,
        incidence=OF_LIBRARY[module.library] if request.iam == "module" else request.iam,
        diffuse_incidence=request.diffuse_iam,
        losses=request.losses,
        inverter=pick_inverter(request.inverter, request.dc_ac_ratio) if request.inverter else None,
        hidden_walls=request.hidden_walls,
        overhangs=request.overhangs == "count",
        usable=dict(request.usable),
        **{key: request.effects.get(key, True) for key in ELECTRIC},
    )


def default_system():
    """The paper's module on open racks, on open area."""
    return PvSystem(pick_module(MODULE))


def check_usable(usable):
    """Refuse shares of kinds without modules, and numbers outside of 0 to 1."""
    for kind, share in usable.items():
        if kind not in BEARING:
            raise InputError("--usable", f"{kind!r} carries no modules", f"give {', '.join(BEARING)}")
        if not 0 <= share <= 1:
            raise InputError("--usable", f"{kind}={share} is not a share", "give numbers from 0 to 1")
