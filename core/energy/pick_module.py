"""The photovoltaic module, from pvlib's copies of the Sandia and CEC libraries."""

import math
from dataclasses import dataclass
from functools import lru_cache

from ..settings.errors import InputError
from .search_library import read_library, search_library

SANDIA, CEC = "SandiaMod", "CECMod"
NEEDED = {
    SANDIA: (
        *("Area", "Cells_in_Series", "Isco", "Voco", "Impo", "Vmpo", "Aisc", "Aimp", "C0", "C1", "C2", "C3"),
        *("Bvoco", "Mbvoc", "Bvmpo", "Mbvmp", "N", "FD"),
        *("A0", "A1", "A2", "A3", "A4", "B0", "B1", "B2", "B3", "B4", "B5"),
    ),
    CEC: ("A_c", "alpha_sc", "a_ref", "I_L_ref", "I_o_ref", "R_sh_ref", "R_s", "Adjust", "I_mp_ref", "V_mp_ref"),
}
AREA = {SANDIA: "Area", CEC: "A_c"}
RATING = {SANDIA: ("Impo", "Vmpo"), CEC: ("I_mp_ref", "V_mp_ref")}


@dataclass(frozen=True)
class Module:
    """A module's parameters in the model of its library."""

    name: str
    library: str  # SandiaMod: Sandia array performance model; CECMod: single-diode model
    parameters: dict  # name -> float, in the units of the model
    area: float  # [m²]
    nominal_power: float  # [W] at reference conditions, current times voltage at the maximum power point


@lru_cache
def pick_module(name):
    """Parameters of a module by its name, or part of its name.

    Parameters
    ----------
    name : str
        As in pvlib's Sandia or CEC library; spaces and punctuation may replace its underscores.

    Returns
    -------
    Module
        Of the Sandia array performance model (SAND2004-3535, :doi:`10.2172/919131`) or the CEC's single-diode model
        (Dobos 2012, :doi:`10.1115/1.4005759`).

    Raises
    ------
    InputError
        If no module or several match the name, or the library lacks a parameter of it.
    """
    library, key = search_library(name, (SANDIA, CEC), option="--module")
    row = read_library(library)[key]
    parameters = {parameter: float(row[parameter]) for parameter in NEEDED[library]}
    missing = [parameter for parameter, value in parameters.items() if not math.isfinite(value)]
    missing += [parameter for parameter in (AREA[library], *RATING[library]) if not parameters[parameter] > 0]
    if missing:
        raise InputError("--module", f"{key} has no {', '.join(missing)} in the library", "choose another module")
    current, voltage = RATING[library]
    return Module(key, library, parameters, parameters[AREA[library]], parameters[current] * parameters[voltage])


def area_of_kwp(module):
    """Module area per kilowatt at reference conditions [m²/kWp]."""
    return module.area / (module.nominal_power / 1000)
