"""The photovoltaic module, from pvlib's copy of the Sandia library."""

import difflib
import math

import pvlib

from ..errors import InputError

NEEDED = (
    *("Area", "Cells_in_Series", "Isco", "Voco", "Impo", "Vmpo", "Aisc", "Aimp", "C0", "C1", "C2", "C3"),
    *("Bvoco", "Mbvoc", "Bvmpo", "Mbvmp", "N", "FD"),
    *("A0", "A1", "A2", "A3", "A4", "B0", "B1", "B2", "B3", "B4", "B5"),
)


def pick_module(name):
    """Parameters of a module in the Sandia array performance model.

    Parameters
    ----------
    name : str
        As in pvlib's Sandia library; blanks and signs may stand for its underscores.

    Returns
    -------
    dict
        Parameter name to float, in the units of the model (SAND2004-3535, :doi:`10.2172/919131`).

    Raises
    ------
    InputError
        The library has no such module (names near matches), or not all of its parameters.
    """
    library = pvlib.pvsystem.retrieve_sam("SandiaMod")
    key = name if name in library else "".join(letter if letter.isalnum() else "_" for letter in name.strip())
    if key not in library:
        near = suggest_modules(name, list(library.columns))
        cure = f"near it: {', '.join(near)}" if near else "see pvlib.pvsystem.retrieve_sam('SandiaMod')"
        raise InputError("--module", f"{name!r} is not in pvlib's Sandia library", cure)
    module = {parameter: float(library[key][parameter]) for parameter in NEEDED}
    missing = [parameter for parameter, value in module.items() if not math.isfinite(value)]
    if missing:
        raise InputError("--module", f"{key} has no {', '.join(missing)} in the library", "choose another module")
    return module


def suggest_modules(name, library):
    """Up to five names of a library that are like a name or hold its words: list of str."""
    wanted = name.lower().replace(" ", "_")
    near = difflib.get_close_matches(wanted, [known.lower() for known in library], n=5, cutoff=0.6)
    holding = [known for known in library if wanted and wanted in known.lower()]
    same = [known for known in library if known.lower() in near]
    return list(dict.fromkeys(holding + same))[:5]


def nominal_power(module):
    """Power of a module at reference conditions [W]: Impo · Vmpo."""
    return module["Impo"] * module["Vmpo"]


def area_of_kwp(module):
    """Area of modules that makes a kilowatt at reference conditions [m²/kWp]."""
    return module["Area"] / (nominal_power(module) / 1000)
