"""What the user asks for: every setting of a run, declared once.

A field of `Request` states a setting's default, unit, range and meaning. The options of the command
line (`commands.add_options`), the properties of Blender's panel (`operators.city.declare_settings`)
and the checks below are made from these declarations: a new setting is one entry here.
"""

import shlex
from dataclasses import asdict, dataclass, fields, replace
from functools import cache
from typing import get_args

from .errors import InputError
from .presets import ESTIMATORS, PRESET_WORDS
from .setting import check_number, check_place, of_city, of_light, of_run, of_weather, setting
from .system_settings import SystemSettings

SKIES = {
    "auto": "Perez where inclined surfaces count, else isotropic",
    "perez": "Brighter around the sun and at the horizon (Perez et al. 1990)",
    "isotropic": "Equally bright all over",
}
BEST_SKY = "perez"  # what "auto" takes where inclined surfaces count, and the key of its effect
KINDS = {int: "integer", float: "number", bool: "switch"}  # by type; others: text


@dataclass
class Request(SystemSettings):
    """Settings of a run; the command line and the panel fill them in."""

    # the city
    lod: str | None = of_city(
        None, "level of detail; default: the best 2.x of each building", metavar="L"
    )
    unit: str = of_city(
        "auto",
        "unit of length of files that name no reference system",
        panel="import",
        choices={
            "auto": (
                "Metres, but where the heights of buildings leave no doubt that it is another one"
            ),
            "m": "Metres",
            "ft": "International feet",
            "us-ft": "US survey feet",
            "mm": "Millimetres",
            "cm": "Centimetres",
            "in": "Inches",
        },
    )
    height: str | None = of_city(
        None,
        "attribute with the height of outlines, NAME, NAME:ft, or NAME:absolute for heights above "
        "the "
        "sea; default: as their producer calls it",
        metavar="NAME",
        title="Height attribute",
        panel="import",
    )
    default_height: float = of_city(
        0.0,
        "height of outlines without a height or floors; 0: refused if more than a tenth, else "
        "left out",
        title="Default height",
        panel="import",
        unit="m",
        least=0,
    )
    up: str = of_city(
        "auto",
        "upward axis of files that do not state it (OBJ)",
        title="Up axis",
        panel="import",
        choices={
            "auto": "The z axis, but where floors leave no doubt that it is y",
            "z": "The file's z axis points up",
            "y": "The file's y axis points up",
        },
    )
    axes: str = of_city(
        "auto",
        "order of the coordinates of files, where nothing in them decides it",
        title="Axes",
        panel="import",
        choices={
            "auto": "As the files and the place tell, else as registered",
            "xy": "Easting or longitude first",
            "yx": "Northing or latitude first",
        },
    )
    orient: str = of_city(
        "auto",
        "flip polygons that face into their building, or keep all as drawn",
        title="Orientation",
        panel="import",
        choices={
            "auto": "Flip polygons that face into their building",
            "as-drawn": "Keep every polygon as drawn",
        },
    )
    latitude: float | None = of_city(
        None, "of the city; default: as in its files", unit="°", least=-90, most=90
    )
    longitude: float | None = of_city(
        None, "of the city; default: as in its files", unit="°", least=-180, most=180
    )
    site_of: str | None = of_city(
        None, "results of another state of this city, whose place and grid are kept", metavar="DIR"
    )
    grid_size: float | None = of_city(
        None, "size of the cells, id#k, into which large polygons are split", unit="m", above=0
    )
    terrain: str | None = of_city(
        None, "measured terrain: TIN relief, OBJ, GeoTIFF or ASC grid", metavar="FILE"
    )
    ground: str = of_city(
        "auto",
        "auto: terrain of the city's files, else as feet; feet: generated through the bases of the "
        "buildings; none",
        choices=("auto", "feet", "none"),
    )
    racks: str = of_city(
        "none",
        "rows of modules on flat roofs: east-west and KEY=VALUE, joined by commas, with keys tilt, "
        "azimuth, spacing or "
        "gcr, depth, rim, height, area, back-albedo",
        panel="classify",
        metavar="SPEC",
    )
    # the weather
    weather: str | list = of_weather(
        "climate",
        "weather files; climate; clear-sky; pvgis, a typical year; or a service with years: "
        "pvgis:2005-2023, "
        "nasa-power:2015-2023, era5:2019, open-meteo:2019",
        kind="texts",
        metavar="FILE",
    )
    time_shift: float = of_weather(
        0.0, "added to the times of weather files", unit="min", least=-720, most=720
    )
    weather_place: tuple | None = of_weather(
        None, "where the weather was measured; default: as its files say", kind="place", unit="°"
    )
    weather_without: str = of_weather(
        "none",
        "column of irradiance to ignore; it then follows from the others",
        choices=("none", "ghi", "dhi", "dni"),
    )
    allow_distance: float = of_weather(
        150.0,
        "largest distance of the weather from the city",
        title="Within [km]",
        panel="weather",
        unit="km",
        least=0,
    )
    weather_point: str = of_weather(
        "nearest",
        "interpolation of gridded weather",
        title="Grid point",
        choices={
            "nearest": "The nearest point of the grid",
            "bilinear": "Between the four points around",
        },
    )
    horizon_cut: str = of_weather(
        "measured",
        "irradiance with the sun below 2°: kept as measured, or left out",
        choices=("measured", "neglect"),
    )
    year: int = of_weather(
        2021, "calendar year of climate and clear sky", title="Year", metavar="Y", least=1
    )
    time_axis: str = of_weather(
        "file",
        "whole hours of a calendar year for sums and series, in a fixed offset from UTC without "
        "summer time: utc or "
        "±HH:MM; file: the weather's own times",
        title="Time axis",
        panel="weather",
        metavar="ZONE",
    )
    weather_seed: int = of_weather(0, "seed of the days and hours of the built-in climate", least=0)
    # the light
    preset: str = of_light(
        "standard",
        "a set of samples, suns and patches; other options take precedence",
        choices=PRESET_WORDS,
    )
    target_error: float | None = of_light(
        None,
        "trace rounds until the error of full load hours on 95 % of the area with modules is below",
        unit="%",
        above=0,
    )
    time_budget: float | None = of_light(
        None,
        "trace further rounds as long as the whole run stays within this time",
        unit="s",
        above=0,
    )
    suns: str = of_light(
        "days:24",
        "sun positions to trace: hourly, days:N, typical-days:N, sky-grid:N",
        metavar="WAY",
    )
    max_bounces: int | None = of_light(
        None,
        "reflections; auto: until little is left",
        title="Reflections",
        panel="trace",
        least=0,
        none="auto",
    )
    albedo: float = of_light(
        0.25,
        "share of the light that buildings reflect",
        panel="trace",
        metavar="A",
        least=0,
        most=1,
    )
    ground_albedo: float = of_light(
        0.25,
        "share of the light that the ground reflects",
        panel="trace",
        metavar="A",
        least=0,
        most=1,
    )
    albedo_file: str | None = of_light(
        None, "albedo or material by surface id, material or kind", metavar="CSV"
    )
    materials: dict = of_light(
        {}, "name of a material -> materials.materials.MaterialSpec", option=""
    )
    file_materials: bool = of_light(
        False, "albedo by the materials of OBJ files", kind="flag", option="--materials"
    )
    ground_material: str = of_light("", "name of the generated ground's material", option="")
    far_ground: bool = of_light(
        True, "open, sunlit ground beyond the city, up to the horizon", panel="trace"
    )
    horizon: str | None = of_light(
        None,
        "distant terrain: GeoTIFF or ASC heights up to 50 km around, angles (csv, PVGIS), or pvgis",
        metavar="FILE",
    )
    sky: str = setting(
        "auto", "model of the diffuse sky", group="sky", panel="trace", choices=SKIES
    )
    estimator: str = of_light("gather", "how light is traced", panel="trace", choices=ESTIMATORS)
    samples: int = of_light(
        256,
        "hemisphere rays per patch; forward: photons from each source",
        title="Sky rays",
        panel="sampling",
        least=4,
        most=2**24,
    )
    shadow_samples: int = of_light(
        16, "shadow rays per patch and sun", title="Sun rays", panel="sampling", least=1
    )
    patch_size: float | None = of_light(
        10.0,
        "longest edge of a patch; smaller is more accurate",
        panel="classify",
        unit="m",
        above=0,
        none="none",
    )
    leaf_area_density: float = of_light(
        1.0, "leaf area density of trees in leaf, one-sided", unit="m²/m³", least=0
    )
    branch_area_density: float = of_light(
        0.2, "branch area density of bare trees", unit="m²/m³", least=0
    )
    leaf_extinction: float = of_light(
        0.5, "extinction coefficient of leaves; 0.5: random angles", metavar="K", above=0
    )
    leaf_months: str = of_light(
        "auto", "months in leaf: auto, all, none or such as 4-10", metavar="MONTHS"
    )
    crown_transmittance: float | None = of_light(
        None,
        "share of light that passes a crown in leaf; default: by leaf area density",
        metavar="T",
        least=0,
        most=1,
    )
    report: str = of_light(
        "eligible",
        "surfaces sampled in full; the others send a quarter of the rays",
        choices=("eligible", "all"),
    )
    effects: dict = setting(
        {}, "overrule the plan of effects", group="effects", kind="pairs", metavar="KEY=on|off"
    )
    seed: int = of_light(
        0, "seed of the rays: the same gives the same results", panel="sampling", least=0
    )
    # the run
    threads: int | None = of_run(None, "threads; default: all processors", least=1)
    private: bool = of_run(
        False,
        "leave names and addresses of buildings out of all that is written",
        kind="flag",
    )

    @property
    def wants_rounds(self):
        """Whether a run goes on after its first round."""
        return self.target_error is not None or self.time_budget is not None

    @property
    def asked_sky(self):
        """Model of the sky that is asked for, by name or as an effect; None: the scene decides."""
        switched = self.effects.get(BEST_SKY)
        if switched is None:
            return None if self.sky == "auto" else self.sky
        if not switched:
            return "isotropic"
        return BEST_SKY if self.sky in ("auto", "isotropic") else self.sky

    def as_dict(self):
        """All settings by name."""
        return asdict(self)

    def check(self):
        """Refuse settings that mean nothing.

        Raises
        ------
        InputError
            Names the option and its allowed values.
        """
        for name, default, details in declared_settings():
            value = getattr(self, name)
            if details.kind in ("number", "integer") and value is not None:
                check_number(option_of(name), value, details)
            elif details.kind == "place" and value is not None:
                check_place(option_of(name), value)
            elif details.kind == "choice" and value not in (default, *details.choices):
                raise InputError(
                    option_of(name),
                    f"{value!r} is not known",
                    f"give {' or '.join(details.choices)}",
                )

    @staticmethod
    def write_options(values):
        """Settings, by name, that are not the default, as they are written on the command line:
        str.
        """
        words = []
        for name, default, details in declared_settings():
            value = values.get(name, default)
            if details.option == "" or value == default or value in ([], (), {}):
                continue
            words.append(option_of(name))
            if isinstance(value, dict):
                words += [f"{key}={_show_switch(entry)}" for key, entry in value.items()]
            elif isinstance(value, list | tuple):
                words += [str(entry) for entry in value]
            elif details.kind != "flag":
                words.append(_show_switch(details.none if value is None else value))
        return " ".join(map(shlex.quote, words))


@cache
def declared_settings(*groups):
    """Name, default and Setting of each field of Request, of some groups or all: tuples.

    What a Setting leaves open follows from the field: its kind from the type, its title from the
    name.
    """
    settings = []
    for field in fields(Request):
        details = field.metadata["setting"]
        if not groups or details.group in groups:
            # of `float | None` the float
            own = KINDS.get((get_args(field.type) or (field.type,))[0], "text")
            kind = details.kind or ("choice" if details.choices else own)
            title = details.title or (
                field.name.replace("_", " ").capitalize() if details.panel else ""
            )
            metavars = {
                "°": "D",
                "m": "M",
                "km": "KM",
                "min": "MIN",
                "s": "S",
                "%": "P",
                "m²/m³": "D",
            }
            metavar = details.metavar or ("N" if kind == "integer" else metavars.get(details.unit))
            default = getattr(Request, field.name, {})  # a dict has no default of the class
            settings.append(
                (field.name, default, replace(details, kind=kind, title=title, metavar=metavar))
            )
    return tuple(settings)


def option_of(name):
    """How a setting is written on the command line: `--max-bounces`."""
    details = next(details for found, _, details in declared_settings() if found == name)
    return details.option or "--" + name.replace("_", "-")


def _show_switch(value):
    """A value in the words of the command line: on and off of a switch."""
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)
