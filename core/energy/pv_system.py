"""What is mounted on the surfaces, and which of their area bears it."""

from dataclasses import dataclass, field

import pvlib

from ..errors import InputError
from .pick_inverter import Inverter, pick_inverter
from .pick_module import CEC, SANDIA, Module, pick_module

MOUNTINGS = {  # Sandia's thermal parameters (King et al. 2004, table 1) as pvlib names them
    "open-rack": "open_rack_glass_polymer",
    "insulated-back": "insulated_back_glass_polymer",
    "close-mount": "close_mount_glass_glass",
}
OF_LIBRARY = {SANDIA: "sapm", CEC: "physical"}  # library -> law of "module"
BEARING = ("facade", "roof", "flat", "rack")  # kinds that --usable may name
MODULE = "SunPower_SPR_300_WHT__2007__E__"  # the paper's


@dataclass(frozen=True)
class PvSystem:
    """Modules, their mounting, what is lost on the way to the grid, and the area that counts."""

    module: Module
    mounting: str = "open-rack"
    incidence: str = "sapm"  # law of the loss by the angle of incidence: sapm, physical, ashrae
    diffuse_incidence: bool = False  # whether diffuse light loses by its angles of incidence, too
    losses: float = 0.0  # [%] of DC energy: soiling, mismatch, wiring …
    inverter: Inverter | None = None
    hidden_walls: str = "leave-out"  # or count: whether covered area bears modules
    overhangs: bool = False  # whether walls that lean outward by more than 1° are facades, as in the paper
    usable: dict = field(default_factory=dict)  # kind -> share of its area that windows and edges leave

    @property
    def feeds_grid(self):
        """Whether anything lies between the modules' DC terminals and the energy that is told."""
        return self.losses > 0 or self.inverter is not None

    @property
    def thermal(self):
        """Parameters a, b and deltaT of Sandia's cell temperature."""
        return pvlib.temperature.TEMPERATURE_MODEL_PARAMETERS["sapm"][MOUNTINGS[self.mounting]]


def build_system(request):
    """The system that the settings ask for.

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
        A share that may bear modules means nothing, or no module or inverter fits its name.
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
    )


def default_system():
    """The paper's module on open racks, on the open area."""
    return PvSystem(pick_module(MODULE))


def check_usable(usable):
    """Refuse shares of kinds that bear no modules, and what is no share."""
    for kind, share in usable.items():
        if kind not in BEARING:
            raise InputError("--usable", f"{kind!r} bears no modules", f"give {', '.join(BEARING)}")
        if not 0 <= share <= 1:
            raise InputError("--usable", f"{kind}={share} is not a share", "give numbers from 0 to 1")
