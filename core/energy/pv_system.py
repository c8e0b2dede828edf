"""The PV system: modules, mounting, losses, inverter, and the area that carries modules.

Modules and inverters are found in pvlib's copies of the libraries of Sandia and of the CEC by a
name or a part of it.
"""

import difflib
import math
import re
from dataclasses import dataclass, field
from functools import cache, lru_cache

import numpy as np
import pvlib

from ..city.classify import BEARING
from ..city.racks import RACK
from ..modules.lay_city import LayoutRules
from ..modules.read_facades import read_facades
from ..settings.errors import InputError
from ..settings.system_settings import CLEARANCES, PAPER_MODULE
from .left_out import read_left_out

SANDIA, CEC = "SandiaMod", "CECMod"
NEEDED = {
    SANDIA: (
        *(
            "Area",
            "Cells_in_Series",
            "Isco",
            "Voco",
            "Impo",
            "Vmpo",
            "Aisc",
            "Aimp",
            "C0",
            "C1",
            "C2",
            "C3",
        ),
        *("Bvoco", "Mbvoc", "Bvmpo", "Mbvmp", "N", "FD"),
        *("A0", "A1", "A2", "A3", "A4", "B0", "B1", "B2", "B3", "B4", "B5"),
    ),
    CEC: (
        "A_c",
        "alpha_sc",
        "a_ref",
        "I_L_ref",
        "I_o_ref",
        "R_sh_ref",
        "R_s",
        "Adjust",
        "I_mp_ref",
        "V_mp_ref",
    ),
}
# area, current, voltage
POSITIVE = {
    SANDIA: ("Area", "Impo", "Vmpo"),
    CEC: ("A_c", "I_mp_ref", "V_mp_ref"),
}
PVWATTS = "pvwatts"
SHOWN = 5  # names that an error lists

SAPM = pvlib.temperature.TEMPERATURE_MODEL_PARAMETERS["sapm"]
MOUNTINGS = {  # a, b and deltaT of Sandia's cell temperature (King et al. 2004, table 1)
    "open-rack": SAPM["open_rack_glass_polymer"],
    "insulated-back": SAPM["insulated_back_glass_polymer"],
    "close-mount": SAPM["close_mount_glass_glass"],
}
ELECTRIC = ("aoi", "spectrum", "temperature")  # effects that may be switched off
KINDS = (*BEARING, RACK)  # that carry modules, in the order of tables


@dataclass(frozen=True)
class Module:
    """A module's parameters in the model of its library."""

    name: str
    library: str  # SandiaMod: Sandia array performance model; CECMod: single-diode model
    parameters: dict  # name -> float, in the units of the model
    area: float  # [m²]
    nominal_power: (
        float  # [W] at reference conditions, current times voltage at the maximum power point
    )
    # length and width [m]: the library's, else of a shape that is usual for so many cells
    size: tuple = ()

    @property
    def area_of_kwp(self):
        """Module area per kilowatt at reference conditions [m²/kWp]."""
        return self.area / (self.nominal_power / 1000)


@dataclass(frozen=True)
class _Inverter:
    """An inverter that is scaled to the modules."""

    name: str
    parameters: dict  # of Sandia's model, name -> float; empty for PVWatts
    dc_ac_ratio: float = 1.0  # nominal power of the modules over the largest AC power


@dataclass(frozen=True)
class PvSystem:
    """Modules, their mounting, the losses up to the grid, and the counted area."""

    module: Module
    mounting: str = "open-rack"  # of MOUNTINGS, or auto: by the kind of the surface
    incidence: str = "sapm"  # incidence angle modifier: sapm, physical, ashrae
    diffuse_incidence: bool = False  # whether diffuse light has an incidence angle modifier, too
    losses: float = 0.0  # [%] of DC energy: soiling, mismatch, wiring …
    inverter: _Inverter | None = None
    # or string: whether what strings of modules lose in shade is counted
    strings: str = "module"
    hidden_walls: str = "leave-out"  # or count: whether covered area carries modules
    # [m] to a face turned against a module, below which there is no room for it
    clearance: float = CLEARANCES[1]
    sectors: str = "8"  # or paper: azimuths that count
    # whether walls that lean outward by more than 1° are facades, as in the paper
    overhangs: bool = False
    # None: every square metre carries modules, as by rules without rows
    layout: LayoutRules | None = None
    # kind -> share that is left to modules by what the city does not show
    usable: dict = field(default_factory=dict)
    least_hours: float = 0.0  # [h] full load hours below which a surface carries no modules
    leave_out: dict = field(default_factory=dict)  # id of a surface or building -> the user's words
    aoi: bool = True  # whether light that falls in at an angle is lost to reflection by the glass
    spectrum: bool = True  # whether the current depends on the spectrum
    # whether cells are as warm as air and light make them, or always at 25 °C
    temperature: bool = True

    @property
    def mountings(self):
        """Mountings that occur, of MOUNTINGS: tuple of str."""
        # The mounting `auto`: close-mount on walls and pitched roofs, open-rack on the others.
        return ("close-mount", "open-rack") if self.mounting == "auto" else (self.mounting,)

    def share_usable(self, surfaces):
        """Share of each of some surfaces that is left to modules by what the city does not show:
        (n,) float64.
        """
        share = np.array([self.usable.get(name, 1.0) for name in surfaces.kind.tolist()])
        return self.layout.of_surfaces(surfaces, "usable", share) if self.layout else share

    def mounting_of(self, kind):
        """Which of `mountings` surfaces of some kinds, (n,) str, have: (n,) int."""
        return (np.isin(kind, ("flat", "rack")) & (self.mounting == "auto")).astype(int)


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
        If a usable share or the file of what is left out is invalid, or no module or inverter
        matches the name.
    """
    # Usable shares, by kind of surface, are only checked; the system gets them as given.
    for kind, share in request.usable.items():
        if kind not in KINDS:
            raise InputError("--usable", f"{kind!r} carries no modules", f"give {', '.join(KINDS)}")
        if not 0 <= share <= 1:
            raise InputError(
                "--usable", f"{kind}={share} is not a share", "give numbers from 0 to 1"
            )
    module = pick_module(request.module)
    # Loss by angle of incidence follows, by default, the library that the module is from: SAPM's
    # polynomial or the physical model.
    return PvSystem(
        module,
        incidence={SANDIA: "sapm", CEC: "physical"}[module.library]
        if request.iam == "module"
        else request.iam,
        diffuse_incidence=request.diffuse_iam,
        inverter=pick_inverter(request.inverter, request.dc_ac_ratio) if request.inverter else None,
        overhangs=request.overhangs == "count",
        usable=dict(request.usable),
        leave_out=read_left_out(request.leave_out) if request.leave_out else {},
        # Rules of layout: size of modules, storeys, bands of windows, and whether modules stand in
        # rows.
        layout=_choose_layout(request, module),
        **{
            # All other settings are taken over unchanged.
            name: getattr(request, name)
            for name in (
                "mounting",
                "losses",
                "strings",
                "hidden_walls",
                "clearance",
                "sectors",
                "least_hours",
            )
        },
        # Effects of electricity (temperature, …) are on unless the request switches them off.
        **{key: request.effects.get(key, True) for key in ELECTRIC},
    )


def _choose_layout(request, module):
    """LayoutRules of the settings."""
    facades = read_facades(request.facades) if request.facades else {}
    # A share of facades stood for their windows: without a band of them it still does.
    band = request.window_band
    if band is None:
        band = 0.0 if "facade" in request.usable else LayoutRules.window_band
    return LayoutRules(
        _parse_size(request.module_size) or module.size,
        request.storey,
        band,
        request.ground_floor,
        facades,
        rows=request.layout == "rows",
    )


def _parse_size(text):
    """Length and width of a module from "L,W" [m], the longer first; None of None.

    Raises
    ------
    InputError
    """
    if text is None:
        return None
    try:
        sides = tuple(sorted(map(float, text.split(",")), reverse=True))
    except ValueError:
        sides = ()
    if len(sides) != 2 or not all(0.05 <= side <= 10 for side in sides):
        raise InputError(
            "--module-size", f"{text!r} is no length and width", "give two, such as 1.76,1.13 [m]"
        )
    return sides


def dc_system():
    """The paper's module on open racks, on open area: DC without losses."""
    return PvSystem(pick_module(PAPER_MODULE))


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
        Of the Sandia array performance model (SAND2004-3535, :doi:`10.2172/919131`) or the CEC's
        single-diode model (Dobos 2012, :doi:`10.1115/1.4005759`).

    Raises
    ------
    InputError
        If no module or several match the name, or the library lacks a parameter of it.
    """
    library, key = _search_library(name, (SANDIA, CEC), option="--module")
    size, current, voltage = POSITIVE[library]
    parameters = _read_parameters(
        library, key, NEEDED[library], POSITIVE[library], option="--module"
    )
    area, power = parameters[size], parameters[current] * parameters[voltage]
    return Module(key, library, parameters, area, power, _size_of_module(library, key, area))


def _size_of_module(library, key, area):
    """Length and width of a product [m]: the CEC's, else by its area and number of cells."""
    row = _read_library(library)[key]
    sides = [float(row.get(name, math.nan)) for name in ("Length", "Width")]
    if all(side > 0 for side in sides):  # also false for NaN
        return tuple(sorted(sides, reverse=True))
    # 6 × 10, 6 × 12 and 8 × 12 cells, with their frames.
    cells = row["N_s" if library == CEC else "Cells_in_Series"]
    shape = {72: 1.95, 96: 1.5}.get(int(cells), 1.65)
    return math.sqrt(area * shape), math.sqrt(area / shape)


@lru_cache
def pick_inverter(name, dc_ac_ratio=1.0):
    """An inverter by its name, or part of its name.

    Parameters
    ----------
    name : str
        pvwatts, or a name of pvlib's library of inverters.
    dc_ac_ratio : float
        Nominal power of the modules over the inverter's largest AC power.

    Returns
    -------
    Inverter

    Raises
    ------
    InputError
        If no inverter or several match the name, or the library lacks a parameter of it.
    """
    if name.lower() == PVWATTS:
        return _Inverter(PVWATTS, {}, dc_ac_ratio)
    library, key = _search_library(name, ("CECInverter", "SandiaInverter"), option="--inverter")
    names = ("Paco", "Pdco", "Vdco", "Pso", "C0", "C1", "C2", "C3", "Pnt")
    return _Inverter(key, _read_parameters(library, key, names, option="--inverter"), dc_ac_ratio)


@lru_cache
def _read_library(library):
    """One of pvlib's tables: pandas.DataFrame, a column for each product."""
    return pvlib.pvsystem.retrieve_sam(library)


def _read_parameters(library, key, names, positive=(), *, option):
    """Parameters of a product by their names, none of them missing, some of them positive: dict of
    float.
    """
    row = _read_library(library)[key]
    parameters = {name: float(row[name]) for name in names}
    missing = [
        name
        for name in names
        if not math.isfinite(parameters[name]) or (name in positive and parameters[name] <= 0)
    ]
    if missing:
        raise InputError(
            option,
            f"{key} has no {', '.join(missing)} in the library",
            f"choose another {option.removeprefix('--')}",
        )
    return parameters


def suggest_modules(text):
    """Names of at most 100 modules that have all words of a text, the Sandia library's first: list
    of str.
    """
    words = _split_words(text)
    names = dict.fromkeys(name for library in (SANDIA, CEC) for name in _read_library(library))
    return [name for name in names if all(word in _join_letters(name) for word in words)][:100]


def _search_library(text, libraries, *, option):
    """Find the one product that a name, or a part of it, matches.

    Case, spaces and punctuation are ignored. A full name takes precedence over a part of one, and a
    part over words in another order.

    Parameters
    ----------
    text : str
    libraries : sequence of str
        Names for `pvlib.pvsystem.retrieve_sam`; the first one with an exact match is used.
    option : str
        Command line option, for the error.

    Returns
    -------
    library, name : str

    Raises
    ------
    InputError
        If no name matches (lists the nearest), or several do (lists some of them).
    """
    # The exact name first.
    for library in libraries:
        if text in _read_library(library):
            return library, text
    # Then letters and digits alone: the whole name, a part of it, or all words in any order; one
    # product must be left.
    known = list(
        dict.fromkeys((library, name) for library in libraries for name in _read_library(library))
    )
    wanted, words = _join_letters(text), _split_words(text)
    rules = [
        lambda one: one == wanted,
        lambda one: wanted in one,
        lambda one: all(word in one for word in words),
    ]
    for fits in rules if wanted else ():
        matches = [(library, name) for library, name in known if fits(_join_letters(name))]
        if len({name for _, name in matches}) == 1:
            return matches[0]
        if matches:
            names = ", ".join(name for _, name in matches[:SHOWN])
            more = f" and {len(matches) - SHOWN:,} more" if len(matches) > SHOWN else ""
            raise InputError(
                option,
                f"{text!r} matches {len(matches):,} names",
                f"give more of the name: {names}{more}",
            )
    # The nearest are found among those with most of its words.
    names = {_join_letters(name): name for _, name in known}
    # Of all names, 400 are compared letter by letter.
    candidates = sorted(names, key=lambda one: -sum(word in one for word in words))[:400]
    nearest = ", ".join(
        names[one] for one in difflib.get_close_matches(wanted, candidates, SHOWN, 0.0)
    )
    raise InputError(
        option,
        f"{text!r} is not in pvlib's libraries ({', '.join(libraries)})",
        f"give one of its names, nearest: {nearest}",
    )


@cache
def _join_letters(name):
    """Letters and digits of a name, in lower case."""
    return "".join(_split_words(name))


def _split_words(text):
    """Words of letters and digits, in lower case."""
    return re.findall(r"[^\W_]+", text.lower())
