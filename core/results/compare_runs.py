"""Who gains and who loses: the results of two states of a city, surface by surface and building by
building.

Surfaces are the same where their shapes are: middle, area and normal agree within some centimetres,
whatever they are called. Those that only one state has are new or gone.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from ..city.site import Site
from ..energy.counted_area import OF_ROWS
from ..settings.errors import InputError, count_of, show_number
from ..settings.request import declared_settings, option_of
from .columns import write_table
from .read_results import Results, read_results, read_table
from .supply_curve import SIDES
from .surfaces_file import GIVE_RESULTS

# of `_tell_yields`
YIELDS = [
    "mwh_per_hour",
    "full_load_hours",
    "full_load_hours_error",
    "mwh",
    "mwh_error",
]
EXISTING, CHANGED, NEW, GONE = "existing", "changed", "new", "gone"  # the second of buildings alone
CHANGE, CHANGE_ERROR = "change.csv", "full_load_hours_change_standard_error"  # of a variant
BEFORE = "before.csv"  # of a variant: hours before the edit, where its base has other hours
BEFORE_COLUMNS = ("full_load_hours", "full_load_hours_standard_error")
ERROR = "mwh_change_standard_error"


@dataclass(repr=False)
class Comparison:
    """Two states of a city."""

    # a row for each surface of the later state, in its order, then those that are gone
    surfaces: pd.DataFrame
    buildings: pd.DataFrame  # a row for each building of either, the one that loses most first
    summary: dict  # sums over the buildings of each state and over all, and what was compared
    later: Results  # of the later state, with outlines

    def __repr__(self):
        change = self.summary["sums"]["all"]["mwh_change"]
        return (
            f"<citypv.Comparison {self.summary['before']} to {self.summary['after']}: "
            f"{count_of(len(self.buildings), 'building')}, {show_number(change, 0, plus=True)} MWh "
            "a year>"
        )


def compare_folders(before, after):
    """Compare two result folders.

    Parameters
    ----------
    before, after : path-like
        Where `after` is a variant of `before`, the errors hold for the difference; else the two
        runs count as independent.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        A folder cannot be read; the hours, the weather, the modules or what counts differ; or a run
        has no outlines.
    """
    folders, known, again = (before, after), None, None
    # Both runs are read.
    before, after = read_results(before), read_results(after)
    layouts = [layout_of(one.summary) for one in (before, after)]
    # Where only one has modules in rows, both get modules on every square metre that counts. Then
    # runs with other hours, weather or modules are refused.
    for one in (before, after) if len({*layouts}) > 1 else ():
        one.faces = _cover_area(one)
    _check_comparable(before, after)
    # Settings of light that may differ; where one is a variant of the other, its file has the
    # errors of the difference, and perhaps the base in the light of the variant, which then takes
    # the place of the base's own yields.
    traced = [(one.summary.get("traced") or {}).get("request") or {} for one in (before, after)]
    names = {name for name, *_ in declared_settings("light", "effects")}
    variant = after.summary.get("variant") or {}
    if variant.get("base_crc32") == mark_of(folders[0]):
        names.discard("albedo_file")  # it holds the edit
        known = _read_by_id(folders[1], CHANGE, (CHANGE_ERROR,), after)[CHANGE_ERROR]
        again = variant.get("base_light")
    if again:
        before.faces = before.faces.assign(
            **_read_by_id(folders[1], BEFORE, BEFORE_COLUMNS, before)
        )
    # Surfaces of both with equal shapes are paired. Yields of each surface in both on the modules
    # of before, then sums of buildings and of all.
    change = compare_states(_state_of(before), _state_of(after), known)
    table, crossed = change.surfaces, change.crossed
    summary = {
        "before": before.name,
        "after": after.name,
        "weather": after.summary["weather"]["label"],
        "sums": change.sums,
        "unit": "MWh per year",
        "light_differs_in": sorted(
            name for name in names if traced[0].get(name) != traced[1].get(name)
        ),
    }
    # Surfaces that an edit takes below the least hours keep the modules of before, and surfaces
    # that it lifts above them get none; both are listed.
    if any(chosen.any() for chosen in crossed.values()):
        summary["paying"] = {"least_hours": after.summary["settings"]["least_hours"]} | {
            name: {
                "surfaces": table["surface_id"][: len(chosen)][chosen].tolist(),
                "mwh_before": float(table["mwh_before"][: len(chosen)][chosen].sum()),
            }
            for name, chosen in crossed.items()
        }
    if len({*layouts}) > 1:
        summary["layout"] = "area"
    if again:
        summary["base_light"] = again
    return Comparison(table, change.buildings, summary, after)


def _read_by_id(folder, name, columns, results):
    """Columns of a variant's table in the order of the surfaces of results: dict of (n,)
    float64.
    """
    table = read_table(Path(folder) / name, ("surface_id",), columns).set_index("surface_id")
    return {
        column: table[column].reindex(results.faces["surface_id"]).to_numpy() for column in columns
    }


def describe_light(light):
    """Number of reflections and sky, of a summary's `base_light`, as text."""
    return f"{count_of(light['max_bounces'], 'reflection')} under the {light['sky']} sky"


def write_before(folder, surface_id, energy):
    """Write the hours of a city before its edit, with their errors: before.csv."""
    columns = {name: np.asarray(getattr(energy, name)) for name in BEFORE_COLUMNS}
    write_table(Path(folder) / BEFORE, pd.DataFrame({"surface_id": surface_id} | columns))


def mark_of(folder):
    """CRC-32 of the hours of a run, by which its variants name it: int."""
    return crc32((Path(folder) / "faces.csv").read_bytes())


class CityState(NamedTuple):
    """The n surfaces of a city in one state."""

    texts: dict  # building_id and kind, and whatever else their table shall tell: (n,) each
    power: np.ndarray  # (n,) float [MW] of their modules, NaN without any
    reasons: np.ndarray  # (n,) str, why there are none, of `REASONS`
    hours: np.ndarray  # (n,) float [h]
    error: np.ndarray  # (n,) float [h], standard error of the hours
    shapes: np.ndarray  # (n, 7) float64 [m], of `_match_shapes`


class StateChange(NamedTuple):
    """What a later state of a city has more or less than an earlier one."""

    match: np.ndarray  # (n,) int, row of the earlier state for each surface of the later one, or -1
    crossed: dict  # of `_share_modules`
    surfaces: pd.DataFrame  # of `_compare_surfaces`
    buildings: pd.DataFrame  # of `_sum_buildings`
    sums: dict  # of `_sum_states`


def compare_states(before, after, errors=None):
    """Hours and energy of two states of a city, both on the modules of before: StateChange.

    Parameters
    ----------
    before, after : CityState
    errors : (n,) float [h], optional
        As of `_compare_surfaces`.
    """
    match = _match_shapes(before.shapes, after.shapes)
    power, crossed = _share_modules(
        (before.power, after.power), (before.reasons, after.reasons), match
    )
    tables = [
        _tell_yields(own, state.hours, state.error).assign(**state.texts)
        for state, own in ((before, before.power), (after, power))
    ]
    surfaces = _compare_surfaces(*tables, match, errors)
    buildings = _sum_buildings(surfaces)
    return StateChange(match, crossed, surfaces, buildings, _sum_states(buildings))


def _state_of(results):
    """CityState of a run. Its hours are means over the whole polygon; modules lie on the part that
    counts.
    """
    faces = results.faces
    counted = faces["counted_area"].where(faces["kwp"] > 0)
    texts = [
        "surface_id",
        "building_id",
        "kind",
        "orientation",
        "area",
        "surface_tilt",
        "surface_azimuth",
        "reason",
    ]
    return CityState(
        dict(faces[texts]),
        (faces["kwp"] * faces["area"] / counted / 1000).to_numpy(),
        faces["reason"].to_numpy(),
        faces["full_load_hours"].to_numpy(),
        faces["full_load_hours_standard_error"].to_numpy(),
        _shapes_of(results),
    )


def _compare_surfaces(before, after, match, errors=None):
    """What the surfaces of two states yield, side by side.

    Parameters
    ----------
    before, after : pandas.DataFrame
        A row for each surface: building_id and kind, other texts, and the columns of
        `_tell_yields`.
    match : (n,) int
        Of `_match_shapes`.
    errors : (n,) float [h], optional
        Standard error of the change of the full load hours, NaN where it is not known.

    Returns
    -------
    pandas.DataFrame
        A row for each surface of the later state, in its order, then those that are gone: their
        texts, the state, hours [h] and energy [MWh] before and after, the change and its standard
        error.
    """
    gone = np.setdiff1d(np.arange(len(before)), match)
    texts = [name for name in after.columns if name not in YIELDS]
    table = pd.concat([after[texts], before[texts].iloc[gone]], ignore_index=True)
    table.insert(2, "state", [EXISTING if row >= 0 else NEW for row in match] + [GONE] * len(gone))
    # NaN where a state lacks the surface: there is no row -1.
    olds = before[YIELDS].reindex([*match, *gone]).reset_index(drop=True)
    news = after[YIELDS].reindex(range(len(table)))
    for name in ("full_load_hours", "mwh"):
        table[f"{name}_before"], table[f"{name}_after"] = olds[name], news[name]
        table[f"{name}_change"] = news[name].fillna(0) - olds[name].fillna(0)
        table.loc[news[name].isna() & olds[name].isna(), f"{name}_change"] = np.nan
        # Surfaces that no changed ray reached have the same bits, and differ by nothing.
        error = np.hypot(olds[f"{name}_error"].fillna(0), news[f"{name}_error"].fillna(0)).to_numpy(
            copy=True
        )
        if errors is not None:
            own = errors if name == "full_load_hours" else errors * after["mwh_per_hour"].to_numpy()
            error[: len(match)] = np.where(
                (match >= 0) & np.isfinite(own), own, error[: len(match)]
            )
        table[f"{name}_change_standard_error"] = np.where(olds[name] == news[name], 0.0, error)
    lone = table["state"] != EXISTING
    table.loc[lone, ["full_load_hours_change", "full_load_hours_change_standard_error"]] = np.nan
    return table


def _check_comparable(before, after):
    """Refuse runs that differ in more than the city.

    Raises
    ------
    InputError
        Names what differs.
    """
    apart = list_differences(before.summary, after.summary)
    if before.interval != after.interval or not before.times.equals(after.times):
        apart.insert("the weather" in apart, "the hours")
    if apart:
        raise InputError(
            "compare",
            f"{before.name} and {after.name} differ in {', '.join(apart)}",
            "compute both with the same, by citypv yield if the light is there",
        )
    for one in (before, after):
        if one.outlines is None:
            raise InputError(
                one.name, "has no shapes of its surfaces, by which they are told", GIVE_RESULTS
            )


def layout_of(summary):
    """Whether modules lie in rows or cover the area, "rows" or "area", as earlier versions' did."""
    return summary["totals"].get("layout", "area")


def _cover_area(results):
    """Faces with modules on every square metre that counts, whatever their layout."""
    faces, summary = results.faces, results.summary
    settings, carries = summary["settings"], faces["reason"].isin(["", *OF_ROWS])
    share = faces["kind"].map(lambda kind: settings["usable"].get(kind, 1.0)).astype(float)
    area = faces["area" if settings["hidden_walls"] == "count" else "open_area"].where(carries, 0.0)
    return faces.assign(
        kwp=area * share / summary["totals"]["area_per_kwp"],
        counted_area=area.where(carries, faces["counted_area"]),
        reason=faces["reason"].mask(carries, ""),
    )


def list_differences(one, other):
    """What two summaries differ in that their numbers rest on: list of str.

    Where modules lie in rows in one only, both are compared on their area.
    """
    apart = ["the weather"] * (one["weather"]["label"] != other["weather"]["label"])
    ignored = {"series", "monthly", "districts", "seed", "threads", "layout"}
    if "area" in (layout_of(one), layout_of(other)):
        ignored |= {"module_size", "storey", "window_band", "ground_floor", "facades"}
    one, other = one["settings"], other["settings"]
    for name, default, _ in declared_settings("weather", "surfaces", "electricity", "sky"):
        # These settings have no effect on what is compared.
        if name not in ignored and one.get(name, default) != other.get(name, default):
            apart.append(option_of(name))
    return apart


def _match_shapes(earlier, later):
    """Row of the earlier state for each surface of the later one, -1 where there is none: (n,) int.

    Two surfaces are the same where each is the other's nearest.

    Parameters
    ----------
    earlier, later : (m, 7) and (n, 7) float64 [m]
        Middle, in the files' grid, root of the area, and normal of each surface.
    """
    match = np.full(len(later), -1)
    if not (len(earlier) and len(later)):
        return match
    middle = earlier[:, :3].mean(axis=0)  # so that eastings lose no digits
    earlier, later = (
        np.column_stack([one[:, :3] - middle, one[:, 3:]]) for one in (earlier, later)
    )
    # Middle, root of the area, and normal times 1 m of one surface may differ by 5 cm.
    distance, nearest = cKDTree(earlier).query(later, distance_upper_bound=0.05)
    _, back = cKDTree(later).query(earlier)
    with_neighbour = np.flatnonzero(np.isfinite(distance))
    mutual = with_neighbour[back[nearest[with_neighbour]] == with_neighbour]
    match[mutual] = nearest[mutual]
    return match


def _shapes_of(results):
    """Middle of the corners, root of the area and normal of each surface: (n, 7) float64 [m], in
    the files' grid.
    """
    outlines, faces = results.outlines, results.faces
    points = Site(**results.summary["input"]["site"]).to_files(outlines.points.astype(float))
    first = outlines.ring_start[outlines.surface_start[:-1]]
    last = outlines.ring_start[
        np.minimum(outlines.surface_start[:-1] + 1, len(outlines.ring_start) - 1)
    ]
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(points - points[:1], axis=0)])
    count = np.maximum(last - first, 1)[:, None]
    middle = (sums[last] - sums[first]) / count + points[:1]
    tilt, azimuth = (
        np.radians(faces["surface_tilt"]),
        np.radians(faces["surface_azimuth"].fillna(0)),
    )
    normal = [np.sin(tilt) * np.sin(azimuth), np.sin(tilt) * np.cos(azimuth), np.cos(tilt)]
    return np.column_stack([middle, np.sqrt(faces["area"]), *normal])


def _share_modules(power, reasons, match):
    """Power of the modules of two states, where what has too few hours in one of them alone carries
    the modules that it had before.

    Parameters
    ----------
    power : tuple of (m,) and (n,) float [MW]
        Of surfaces before and after, NaN where there are no modules.
    reasons : tuple of (m,) and (n,) str
        Why there are none, of `REASONS`.
    match : (n,) int
        Of `_match_shapes`.

    Returns
    -------
    power : (n,) float [MW]
        After, on the modules of before.
    crossed : dict of str to (n,) bool
        Surfaces that an edit brings below the least hours, `no_longer`, or above, `newly`.
    """
    few, (earlier, new) = "low-hours", reasons
    old = np.where(match >= 0, earlier[match], "new")
    crossed = {"no_longer": (old == "") & (new == few), "newly": (old == few) & (new == "")}
    shared = np.where(crossed["no_longer"], power[0][match], power[1])
    return np.where(crossed["newly"], np.nan, shared), crossed


def _tell_yields(power, hours, error):
    """Columns `YIELDS` of surfaces from the power [MW] of their modules, NaN where there are none:
    pandas.DataFrame.
    """
    columns = zip(YIELDS, (power, hours, error, power * hours, power * error), strict=True)
    return pd.DataFrame(
        {name: np.where(np.isfinite(power), values, np.nan) for name, values in columns}
    )


def _sum_buildings(table):
    """Energy of each building before and after, with the change and its standard error, roofs and
    facades apart.

    A building with surfaces that are new or gone has changed itself; the others exist as before.
    """
    for side, kinds in SIDES.items():
        table = table.assign(
            **{f"mwh_change_{side}": table["mwh_change"].where(table["kind"].isin(kinds), 0.0)}
        )
    rows = []
    for name, own in table.groupby("building_id", sort=True):
        states, sums = own["state"].unique(), _sum_energy(own)
        percent = (
            100 * sums["mwh_change"] / sums["mwh_before"] if sums["mwh_before"] > 0 else np.nan
        )
        state = states[0] if len(states) == 1 else CHANGED
        rows.append({"building_id": name, "state": state, **sums, "percent_change": percent})
    return pd.DataFrame(rows).sort_values(["mwh_change", "building_id"], ignore_index=True)


def _sum_energy(rows):
    """Sums over some surfaces or buildings, whose errors count as independent: dict."""
    return {
        name: float(rows[name].sum() if name != ERROR else np.sqrt((rows[name] ** 2).sum()))
        for name in [
            "mwh_before",
            "mwh_after",
            "mwh_change",
            ERROR,
            *(f"mwh_change_{side}" for side in SIDES),
        ]
    }


def _sum_states(buildings):
    """Sums [MWh per year] over the buildings of each state and over all: dict of dict."""
    states = {
        name: buildings[buildings["state"] == name] for name in (EXISTING, CHANGED, NEW, GONE)
    }
    return {
        name: {"buildings": len(own), **_sum_energy(own)}
        for name, own in (states | {"all": buildings}).items()
    }
