"""The photovoltaic module, from pvlib's copies of the Sandia and CEC libraries."""

import difflib
import math
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
import pvlib

from ..errors import InputError

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


PVWATTS = "pvwatts"
EFFICIENCY = 0.96  # of PVWatts' inverter at full load (Dobos 2014, NREL/TP-6A20-62641)
OF_INVERTER = ("Paco", "Pdco", "Vdco", "Pso", "C0", "C1", "C2", "C3", "Pnt")


@dataclass(frozen=True)
class Inverter:
    """An inverter that is scaled to the modules."""

    name: str
    parameters: dict  # of Sandia's model, name -> float; empty for PVWatts
    dc_ac_ratio: float = 1.0  # nominal power of the modules over the largest AC power


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
        return Inverter(PVWATTS, {}, dc_ac_ratio)
    library, key = search_library(name, ("CECInverter", "SandiaInverter"), option="--inverter")
    row = read_library(library)[key]
    parameters = {parameter: float(row[parameter]) for parameter in OF_INVERTER}
    missing = [parameter for parameter, value in parameters.items() if not math.isfinite(value)]
    if missing:
        raise InputError("--inverter", f"{key} has no {', '.join(missing)} in the library", "choose another inverter")
    return Inverter(key, parameters, dc_ac_ratio)


def convert_power(power, inverter):
    """AC power of an inverter with as many modules as its size requires.

    The input voltage is the inverter's nominal one: strings are assumed to fit. Consumption at night is neglected.

    Parameters
    ----------
    power : numpy.ndarray
        DC power over the modules' nominal power.
    inverter : Inverter

    Returns
    -------
    numpy.ndarray
        AC power over the modules' nominal DC power, not negative.
    """
    power, own = np.asarray(power, float), inverter.parameters
    if inverter.name == PVWATTS:
        return pvlib.inverter.pvwatts(power, 1.0 / inverter.dc_ac_ratio / EFFICIENCY, EFFICIENCY)
    size = own["Paco"] * inverter.dc_ac_ratio  # [W] of modules
    return np.maximum(pvlib.inverter.sandia(own["Vdco"], power * size, own), 0.0) / size


SHOWN = 5  # names that an error lists
CANDIDATES = 400  # names that are compared letter by letter


@lru_cache
def read_library(library):
    """One of pvlib's tables: pandas.DataFrame, a column for each product."""
    return pvlib.pvsystem.retrieve_sam(library)


def search_library(text, libraries, *, option):
    """Find the one product that a name, or a part of it, matches.

    Case, spaces and punctuation are ignored. A full name takes precedence over a part of one, and a part over words in
    another order.

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
    for library in libraries:
        if text in read_library(library):
            return library, text
    known = list(dict.fromkeys((library, name) for library in libraries for name in read_library(library)))
    wanted, words = join_letters(text), split_words(text)
    fits = [
        lambda name: join_letters(name) == wanted,
        lambda name: wanted in join_letters(name),
        lambda name: all(word in join_letters(name) for word in words),
    ]
    for fit in fits if wanted else ():
        found = [(library, name) for library, name in known if fit(name)]
        if len({name for _, name in found}) == 1:
            return found[0]
        if found:
            names = ", ".join(name for _, name in found[:SHOWN])
            more = f" and {len(found) - SHOWN:,} more" if len(found) > SHOWN else ""
            raise InputError(option, f"{text!r} matches {len(found):,} names", f"give more of the name: {names}{more}")
    nearest = list_nearest(text, [name for _, name in known])
    raise InputError(
        option,
        f"{text!r} is not in pvlib's libraries ({', '.join(libraries)})",
        f"give one of its names, nearest: {nearest}",
    )


def list_nearest(text, names):
    """The names most similar to a text, joined by commas: those with most of its words, then by similarity."""
    words = split_words(text)
    shared = {name: sum(word in join_letters(name) for word in words) for name in names}
    candidates = sorted(names, key=lambda name: -shared[name])[:CANDIDATES]
    wanted = join_letters(text)
    matcher = difflib.SequenceMatcher(b=wanted, autojunk=False)

    def likeness(name):
        matcher.set_seq1(join_letters(name))
        return shared[name], matcher.ratio()

    return ", ".join(sorted(candidates, key=likeness, reverse=True)[:SHOWN])


@cache
def join_letters(name):
    """Letters and digits of a name, in lower case."""
    return "".join(letter for letter in name.lower() if letter.isalnum())


def split_words(text):
    """Words of letters and digits, in lower case."""
    return "".join(letter if letter.isalnum() else " " for letter in text.lower()).split()
