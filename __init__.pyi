"""CityPV in Python: functions, their settings, and results. Written by tools/make_stubs.py."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import pandas as pd
import xarray as xr

StrPath = str | PathLike[str]
Progress = Callable[[str, float, float, str], object]

__version__: str

class InputError(ValueError):
    """Input or settings that cannot be used: names the file, the place and the cure."""

class Result:
    """Results of a run: the files of its folder, each read when it is asked for.

    Parameters
    ----------
    folder : path-like
        Of `simulate`, or of the command line.
    temporary : bool
        Whether the folder above it is deleted with this object.
    """

    folder: Path
    def __init__(self, folder: StrPath, *, temporary: bool = False): ...
    @property
    def faces(self) -> pd.DataFrame:
        """Surfaces, a row each: pandas.DataFrame of faces.csv; `eligible` is bool."""
        ...
    @property
    def groups(self) -> pd.DataFrame:
        """Groups of surfaces by kind and orientation, a row for each period: pandas.DataFrame of
        groups.csv.
        """
        ...
    @property
    def buildings(self) -> pd.DataFrame:
        """Buildings, a row each: pandas.DataFrame of buildings.csv."""
        ...
    @property
    def districts(self) -> pd.DataFrame:
        """Sums by district, of a run that was given `districts`, the last row of what lies in none:
        pandas.DataFrame of districts.csv.
        """
        ...
    @property
    def timeseries(self) -> xr.Dataset:
        """Capacity factors of the groups at each time: xarray.Dataset of timeseries.nc."""
        ...
    @property
    def summary(self) -> dict[str, Any]:
        """Settings, totals, errors and versions of the run: dict of summary.json."""
        ...
    def save(
        self,
        folder: StrPath,
        *,
        overwrite: bool = False,
    ) -> Result:
        """Copy the results to a folder: Result of it.

        Raises
        ------
        InputError
            The folder is not empty and `overwrite` is False, or cannot be written.
        """
        ...

    def with_weather(
        self,
        weather: StrPath | Sequence[StrPath],
        *,
        out: StrPath | None = None,
        overwrite: bool = False,
        progress: Progress = ...,
        method: Literal["paper"] | None = None,
        module: str = "SunPower_SPR_300_WHT__2007__E__",
        mounting: Literal["open-rack", "insulated-back", "close-mount", "auto"] = "auto",
        iam: Literal["module", "physical", "ashrae"] = "module",
        diffuse_iam: bool = False,
        losses: float = 11.4,
        inverter: str | None = "pvwatts",
        dc_ac_ratio: float = 1.0,
        strings: Literal["module", "string"] = "module",
        hidden_walls: Literal["leave-out", "count"] = "leave-out",
        clearance: float = 0.3,
        sectors: Literal["8", "paper"] = "8",
        overhangs: Literal["leave-out", "count"] = "leave-out",
        usable: Mapping[str, float] = ...,
        least_hours: float = 0.0,
        leave_out: StrPath | None = None,
        layout: Literal["rows", "area"] = "rows",
        module_size: str | None = None,
        storey: float = 3.0,
        window_band: float | None = None,
        ground_floor: bool = False,
        facades: StrPath | None = None,
        series: str | Sequence[str] = (),
        monthly: bool = False,
        districts: StrPath | None = None,
        time_shift: float = 0.0,
        weather_place: tuple[float, float] | None = None,
        weather_without: Literal["none", "ghi", "dhi", "dni"] = "none",
        allow_distance: float = 150.0,
        weather_point: Literal["nearest", "bilinear"] = "nearest",
        horizon_cut: Literal["measured", "neglect"] = "measured",
        year: int = 2021,
        time_axis: str = "file",
        weather_seed: int = 0,
        sky: Literal["auto", "perez", "isotropic"] = "auto",
        effects: Mapping[str, bool] = ...,
        threads: int | None = None,
        private: bool = False,
    ) -> Result:
        """Compute the electricity of this light in another weather: Result. Module, system and sky
        stay as they were unless given.

        Parameters
        ----------
        weather : str, path-like or list
        out, overwrite, progress, **settings
            As in `simulate`.

        Raises
        ------
        InputError
            There is no transfer.nc, or a setting cannot be used.

        Other Parameters
        ----------------
        method : {'paper'}, optional
            settings as in the paper (docs/reference/method_paper.md); others take precedence
        module : str, default 'SunPower_SPR_300_WHT__2007__E__'
            module: name, or part of it, in pvlib's Sandia or CEC library
        mounting : {'open-rack', 'insulated-back', 'close-mount', 'auto'}, default 'auto'
            mounting of the modules, which determines the cell temperature
        iam : {'module', 'physical', 'ashrae'}, default 'module'
            incidence angle modifier of direct light
        diffuse_iam : bool, default False
            incidence angle modifier of diffuse light, too
        losses : float, default 11.4
            [%] DC energy lost to soiling, mismatch, wiring, outages …
        inverter : str, default 'pvwatts'
            pvwatts, an inverter of pvlib's library, or none
        dc_ac_ratio : float, default 1.0
            nominal power of modules over that of the inverter
        strings : {'module', 'string'}, default 'module'
            what has a maximum power point of its own; what strings lose in shade is told with
            either
        hidden_walls : {'leave-out', 'count'}, default 'leave-out'
            whether wall area that a neighbour covers counts
        clearance : float, default 0.3
            [m] room before a module, up to a face turned against it
        sectors : {'8', 'paper'}, default '8'
            azimuths of roofs and facades that count
        overhangs : {'leave-out', 'count'}, default 'leave-out'
            whether walls that lean outward by more than 1° are facades
        usable : dict of str to float, default {}
            share that is left to modules by what the city does not show, by kind
        least_hours : float, default 0.0
            [h] full load hours of a long-term year below which a face carries no modules
        leave_out : str, optional
            faces or buildings that carry no modules, such as protected ones: id,words
        layout : {'rows', 'area'}, default 'rows'
            how modules are laid out on what counts
        module_size : str, optional
            [m] length and width of a module; default: the product's
        storey : float, default 3.0
            [m] height of storeys where no windows are drawn
        window_band : float, optional
            [m] height of the windows of each storey where none are drawn; auto: 1.4, but 0 where
            --usable gives a share of facades
        ground_floor : bool, default False
            modules on the lowest storey of facades with windows, too
        facades : str, optional
            storey, window_band and usable share by surface id or kind
        series : list of str, default ()
            ids of surfaces whose hourly series are written to series.csv; buildings: power of each
            in timeseries.nc
        monthly : bool, default False
            add monthly full load hours to faces.csv and buildings.csv
        districts : str, optional
            polygons with a name, for sums by district: FILE, or FILE:COLUMN with the names
        time_shift : float, default 0.0
            [min] added to the times of weather files
        weather_place : (float, float), optional
            [°] where the weather was measured; default: as its files say
        weather_without : {'none', 'ghi', 'dhi', 'dni'}, default 'none'
            column of irradiance to ignore; it then follows from the others
        allow_distance : float, default 150.0
            [km] largest distance of the weather from the city
        weather_point : {'nearest', 'bilinear'}, default 'nearest'
            interpolation of gridded weather
        horizon_cut : {'measured', 'neglect'}, default 'measured'
            irradiance with the sun below 2°: kept as measured, or left out
        year : int, default 2021
            calendar year of climate and clear sky
        time_axis : str, default 'file'
            whole hours of a calendar year for sums and series, in a fixed offset from UTC without
            summer time: utc or ±HH:MM; file: the weather's own times
        weather_seed : int, default 0
            seed of the days and hours of the built-in climate
        sky : {'auto', 'perez', 'isotropic'}, default 'auto'
            model of the diffuse sky
        effects : dict of str to bool, default {}
            overrule the plan of effects
        threads : int, optional
            threads; default: all processors
        private : bool, default False
            leave names and addresses of buildings out of all that is written
        """
        ...

    def variant(
        self,
        *,
        out: StrPath | None = None,
        overwrite: bool = False,
        exports: str | Sequence[str] = (),
        progress: Progress = ...,
        add: Sequence[StrPath] = ...,
        remove: Sequence[str] = ...,
        move: Mapping[str, tuple[float, float]] = ...,
        raised: Mapping[str, float] = ...,
        albedo_of: Mapping[str, float] = ...,
        local: bool = False,
        private: bool = ...,
    ) -> Result:
        """Edit the city and trace what the edit changes, from what its rays met: Result.

        Parameters
        ----------
        out, overwrite, exports, progress
            As in `simulate`; with "editable" among the exports it can be edited again.
        **change
            Fields of `variant.Change`: add (files), remove (ids), move {id: (east, north)} [m],
            raised {id: metres}, albedo_of {id: albedo}, local, private.

        Raises
        ------
        InputError
            The run was not made with exports=("editable",), or the change cannot be used.
        """
        ...

    def plot(
        self,
        *,
        title: str = ...,
        attribution: str = ...,
        language: str = ...,
        districts: str | None = None,
        private: bool = False,
    ) -> Path:
        """Write report.html into the folder: its path.

        Parameters
        ----------
        title : str
            Heading of the page; by default with the name of the folder.
        attribution : str
            Source and licence of the city model; by default as its files say.
        language : str
            Of texts and numbers: "en" or "de".
        districts : str
            FILE or FILE:COLUMN of districts; by default those that the run was given.
        private : bool
            Leave out names and addresses of buildings.
        """
        ...

class Comparison:
    """Two states of a city."""

    surfaces: pd.DataFrame
    buildings: pd.DataFrame
    summary: dict[str, Any]
    later: Any

def simulate(
    city: StrPath | Sequence[StrPath],
    *,
    out: StrPath | None = None,
    overwrite: bool = False,
    exports: str | Sequence[str] = (),
    cluster: str | None = None,
    tile: float | None = None,
    progress: Progress = ...,
    method: Literal["paper"] | None = None,
    module: str = "SunPower_SPR_300_WHT__2007__E__",
    mounting: Literal["open-rack", "insulated-back", "close-mount", "auto"] = "auto",
    iam: Literal["module", "physical", "ashrae"] = "module",
    diffuse_iam: bool = False,
    losses: float = 11.4,
    inverter: str | None = "pvwatts",
    dc_ac_ratio: float = 1.0,
    strings: Literal["module", "string"] = "module",
    hidden_walls: Literal["leave-out", "count"] = "leave-out",
    clearance: float = 0.3,
    sectors: Literal["8", "paper"] = "8",
    overhangs: Literal["leave-out", "count"] = "leave-out",
    usable: Mapping[str, float] = ...,
    least_hours: float = 0.0,
    leave_out: StrPath | None = None,
    layout: Literal["rows", "area"] = "rows",
    module_size: str | None = None,
    storey: float = 3.0,
    window_band: float | None = None,
    ground_floor: bool = False,
    facades: StrPath | None = None,
    series: str | Sequence[str] = (),
    monthly: bool = False,
    districts: StrPath | None = None,
    lod: str | None = None,
    unit: Literal["auto", "m", "ft", "us-ft", "mm", "cm", "in"] = "auto",
    height: str | None = None,
    default_height: float = 0.0,
    up: Literal["auto", "z", "y"] = "auto",
    axes: Literal["auto", "xy", "yx"] = "auto",
    orient: Literal["auto", "as-drawn"] = "auto",
    latitude: float | None = None,
    longitude: float | None = None,
    site_of: StrPath | None = None,
    grid_size: float | None = None,
    terrain: StrPath | None = None,
    ground: Literal["auto", "feet", "none"] = "auto",
    racks: str = "none",
    weather: StrPath = "climate",
    time_shift: float = 0.0,
    weather_place: tuple[float, float] | None = None,
    weather_without: Literal["none", "ghi", "dhi", "dni"] = "none",
    allow_distance: float = 150.0,
    weather_point: Literal["nearest", "bilinear"] = "nearest",
    horizon_cut: Literal["measured", "neglect"] = "measured",
    year: int = 2021,
    time_axis: str = "file",
    weather_seed: int = 0,
    preset: Literal["draft", "standard", "reference"] = "standard",
    target_error: float | None = None,
    time_budget: float | None = None,
    suns: str = "days:24",
    max_bounces: int | None = None,
    albedo: float = 0.25,
    ground_albedo: float = 0.25,
    albedo_file: StrPath | None = None,
    materials: Mapping[str, Any] = ...,
    file_materials: bool = False,
    ground_material: str = "",
    far_ground: bool = True,
    horizon: StrPath | None = None,
    sky: Literal["auto", "perez", "isotropic"] = "auto",
    estimator: Literal["gather", "forward"] = "gather",
    samples: int = 256,
    shadow_samples: int = 16,
    patch_size: float | None = 10.0,
    leaf_area_density: float = 1.0,
    branch_area_density: float = 0.2,
    leaf_extinction: float = 0.5,
    leaf_months: str = "auto",
    crown_transmittance: float | None = None,
    report: Literal["eligible", "all"] = "eligible",
    effects: Mapping[str, bool] = ...,
    seed: int = 0,
    threads: int | None = None,
    private: bool = False,
) -> Result:
    """Trace a city and compute its full load hours.

    Parameters
    ----------
    city : path-like or list of path-like
        CityGML, CityJSON or OBJ files, or folders of them.
    out : path-like, optional
        Folder to write; by default one that is deleted with the Result.
    overwrite : bool
        Replace results in a folder that is not empty.
    exports : str or collection of str
        Of transfer (even where it is large), cityjson, gltf and geopackage: files to write as well.
    cluster : str, optional
        Trace in tiles: "serial", "local:N" or the address of a Dask scheduler.
    tile : float, optional
        Side of the tiles [m].
    progress : callable, optional
        Called with stage, done, total and unit.
    **settings
        As the options of ``citypv simulate``, with underscores: weather, preset, target_error …

    Returns
    -------
    Result

    Raises
    ------
    InputError
        A setting does not exist or cannot be used, or a file is invalid.
    KeyboardInterrupt, CancelledError
        Interrupted before there was anything to keep.

    Other Parameters
    ----------------
    method : {'paper'}, optional
        settings as in the paper (docs/reference/method_paper.md); others take precedence
    module : str, default 'SunPower_SPR_300_WHT__2007__E__'
        module: name, or part of it, in pvlib's Sandia or CEC library
    mounting : {'open-rack', 'insulated-back', 'close-mount', 'auto'}, default 'auto'
        mounting of the modules, which determines the cell temperature
    iam : {'module', 'physical', 'ashrae'}, default 'module'
        incidence angle modifier of direct light
    diffuse_iam : bool, default False
        incidence angle modifier of diffuse light, too
    losses : float, default 11.4
        [%] DC energy lost to soiling, mismatch, wiring, outages …
    inverter : str, default 'pvwatts'
        pvwatts, an inverter of pvlib's library, or none
    dc_ac_ratio : float, default 1.0
        nominal power of modules over that of the inverter
    strings : {'module', 'string'}, default 'module'
        what has a maximum power point of its own; what strings lose in shade is told with
        either
    hidden_walls : {'leave-out', 'count'}, default 'leave-out'
        whether wall area that a neighbour covers counts
    clearance : float, default 0.3
        [m] room before a module, up to a face turned against it
    sectors : {'8', 'paper'}, default '8'
        azimuths of roofs and facades that count
    overhangs : {'leave-out', 'count'}, default 'leave-out'
        whether walls that lean outward by more than 1° are facades
    usable : dict of str to float, default {}
        share that is left to modules by what the city does not show, by kind
    least_hours : float, default 0.0
        [h] full load hours of a long-term year below which a face carries no modules
    leave_out : str, optional
        faces or buildings that carry no modules, such as protected ones: id,words
    layout : {'rows', 'area'}, default 'rows'
        how modules are laid out on what counts
    module_size : str, optional
        [m] length and width of a module; default: the product's
    storey : float, default 3.0
        [m] height of storeys where no windows are drawn
    window_band : float, optional
        [m] height of the windows of each storey where none are drawn; auto: 1.4, but 0 where
        --usable gives a share of facades
    ground_floor : bool, default False
        modules on the lowest storey of facades with windows, too
    facades : str, optional
        storey, window_band and usable share by surface id or kind
    series : list of str, default ()
        ids of surfaces whose hourly series are written to series.csv; buildings: power of each
        in timeseries.nc
    monthly : bool, default False
        add monthly full load hours to faces.csv and buildings.csv
    districts : str, optional
        polygons with a name, for sums by district: FILE, or FILE:COLUMN with the names
    lod : str, optional
        level of detail; default: the best 2.x of each building
    unit : {'auto', 'm', 'ft', 'us-ft', 'mm', 'cm', 'in'}, default 'auto'
        unit of length of files that name no reference system
    height : str, optional
        attribute with the height of outlines, NAME, NAME:ft, or NAME:absolute for heights above
        the sea; default: as their producer calls it
    default_height : float, default 0.0
        [m] height of outlines without a height or floors; 0: refused if more than a tenth, else
        left out
    up : {'auto', 'z', 'y'}, default 'auto'
        upward axis of files that do not state it (OBJ)
    axes : {'auto', 'xy', 'yx'}, default 'auto'
        order of the coordinates of files, where nothing in them decides it
    orient : {'auto', 'as-drawn'}, default 'auto'
        flip polygons that face into their building, or keep all as drawn
    latitude : float, optional
        [°] of the city; default: as in its files
    longitude : float, optional
        [°] of the city; default: as in its files
    site_of : str, optional
        results of another state of this city, whose place and grid are kept
    grid_size : float, optional
        [m] size of the cells, id#k, into which large polygons are split
    terrain : str, optional
        measured terrain: TIN relief, OBJ, GeoTIFF or ASC grid
    ground : {'auto', 'feet', 'none'}, default 'auto'
        auto: terrain of the city's files, else as feet; feet: generated through the bases of
        the buildings; none
    racks : str, default 'none'
        rows of modules on flat roofs: east-west and KEY=VALUE, joined by commas, with keys
        tilt, azimuth, spacing or gcr, depth, rim, height, area, back-albedo
    weather : path-like or list, default 'climate'
        weather files; climate; clear-sky; pvgis, a typical year; or a service with years:
        pvgis:2005-2023, nasa-power:2015-2023, era5:2019, open-meteo:2019
    time_shift : float, default 0.0
        [min] added to the times of weather files
    weather_place : (float, float), optional
        [°] where the weather was measured; default: as its files say
    weather_without : {'none', 'ghi', 'dhi', 'dni'}, default 'none'
        column of irradiance to ignore; it then follows from the others
    allow_distance : float, default 150.0
        [km] largest distance of the weather from the city
    weather_point : {'nearest', 'bilinear'}, default 'nearest'
        interpolation of gridded weather
    horizon_cut : {'measured', 'neglect'}, default 'measured'
        irradiance with the sun below 2°: kept as measured, or left out
    year : int, default 2021
        calendar year of climate and clear sky
    time_axis : str, default 'file'
        whole hours of a calendar year for sums and series, in a fixed offset from UTC without
        summer time: utc or ±HH:MM; file: the weather's own times
    weather_seed : int, default 0
        seed of the days and hours of the built-in climate
    preset : {'draft', 'standard', 'reference'}, default 'standard'
        a set of samples, suns and patches; other options take precedence
    target_error : float, optional
        [%] trace rounds until the error of full load hours on 95 % of the area with modules is
        below
    time_budget : float, optional
        [s] trace further rounds as long as the whole run stays within this time
    suns : str, default 'days:24'
        sun positions to trace: hourly, days:N, typical-days:N, sky-grid:N
    max_bounces : int, optional
        reflections; auto: until little is left
    albedo : float, default 0.25
        share of the light that buildings reflect
    ground_albedo : float, default 0.25
        share of the light that the ground reflects
    albedo_file : str, optional
        albedo or material by surface id, material or kind
    materials : str, default {}
        name of a material -> materials.materials.MaterialSpec
    file_materials : bool, default False
        albedo by the materials of OBJ files
    ground_material : str, default ''
        name of the generated ground's material
    far_ground : bool, default True
        open, sunlit ground beyond the city, up to the horizon
    horizon : str, optional
        distant terrain: GeoTIFF or ASC heights up to 50 km around, angles (csv, PVGIS), or
        pvgis
    sky : {'auto', 'perez', 'isotropic'}, default 'auto'
        model of the diffuse sky
    estimator : {'gather', 'forward'}, default 'gather'
        how light is traced
    samples : int, default 256
        hemisphere rays per patch; forward: photons from each source
    shadow_samples : int, default 16
        shadow rays per patch and sun
    patch_size : float, default 10.0
        [m] longest edge of a patch; smaller is more accurate
    leaf_area_density : float, default 1.0
        [m²/m³] leaf area density of trees in leaf, one-sided
    branch_area_density : float, default 0.2
        [m²/m³] branch area density of bare trees
    leaf_extinction : float, default 0.5
        extinction coefficient of leaves; 0.5: random angles
    leaf_months : str, default 'auto'
        months in leaf: auto, all, none or such as 4-10
    crown_transmittance : float, optional
        share of light that passes a crown in leaf; default: by leaf area density
    report : {'eligible', 'all'}, default 'eligible'
        surfaces sampled in full; the others send a quarter of the rays
    effects : dict of str to bool, default {}
        overrule the plan of effects
    seed : int, default 0
        seed of the rays: the same gives the same results
    threads : int, optional
        threads; default: all processors
    private : bool, default False
        leave names and addresses of buildings out of all that is written
    """
    ...

def read_results(
    folder: StrPath,
) -> Result:
    """Results of an earlier run: Result.

    Raises
    ------
    InputError
        A file is missing, cannot be read, or belongs to another run than the others.
    """
    ...

def compare(
    before: Result | StrPath,
    after: Result | StrPath,
    *,
    out: StrPath | None = None,
    overwrite: bool = False,
) -> Comparison:
    """Who gains and who loses between two states of a city: Comparison, with surfaces, buildings
    and summary.

    Parameters
    ----------
    before, after : Result or path-like
    out : path-like, optional
        Folder for tables and a page with maps.
    overwrite : bool
    """
    ...

def inspect(
    city: StrPath | Sequence[StrPath],
    *,
    sectors: Literal["8", "paper"] = "8",
    lod: str | None = None,
    unit: Literal["auto", "m", "ft", "us-ft", "mm", "cm", "in"] = "auto",
    height: str | None = None,
    default_height: float = 0.0,
    up: Literal["auto", "z", "y"] = "auto",
    axes: Literal["auto", "xy", "yx"] = "auto",
    orient: Literal["auto", "as-drawn"] = "auto",
    latitude: float | None = None,
    longitude: float | None = None,
    site_of: StrPath | None = None,
    grid_size: float | None = None,
    terrain: StrPath | None = None,
    ground: Literal["auto", "feet", "none"] = "auto",
    racks: str = "none",
) -> dict[str, Any]:
    """What is read of a city, repaired and left out, and where it is: dict, as ``citypv inspect
    --json``.

    Other Parameters
    ----------------
    sectors : {'8', 'paper'}, default '8'
        azimuths of roofs and facades that count
    lod : str, optional
        level of detail; default: the best 2.x of each building
    unit : {'auto', 'm', 'ft', 'us-ft', 'mm', 'cm', 'in'}, default 'auto'
        unit of length of files that name no reference system
    height : str, optional
        attribute with the height of outlines, NAME, NAME:ft, or NAME:absolute for heights above
        the sea; default: as their producer calls it
    default_height : float, default 0.0
        [m] height of outlines without a height or floors; 0: refused if more than a tenth, else
        left out
    up : {'auto', 'z', 'y'}, default 'auto'
        upward axis of files that do not state it (OBJ)
    axes : {'auto', 'xy', 'yx'}, default 'auto'
        order of the coordinates of files, where nothing in them decides it
    orient : {'auto', 'as-drawn'}, default 'auto'
        flip polygons that face into their building, or keep all as drawn
    latitude : float, optional
        [°] of the city; default: as in its files
    longitude : float, optional
        [°] of the city; default: as in its files
    site_of : str, optional
        results of another state of this city, whose place and grid are kept
    grid_size : float, optional
        [m] size of the cells, id#k, into which large polygons are split
    terrain : str, optional
        measured terrain: TIN relief, OBJ, GeoTIFF or ASC grid
    ground : {'auto', 'feet', 'none'}, default 'auto'
        auto: terrain of the city's files, else as feet; feet: generated through the bases of
        the buildings; none
    racks : str, default 'none'
        rows of modules on flat roofs: east-west and KEY=VALUE, joined by commas, with keys
        tilt, azimuth, spacing or gcr, depth, rim, height, area, back-albedo
    """
    ...

def world(
    environments: StrPath | Sequence[StrPath],
    *,
    out: StrPath | None = None,
    overwrite: bool = False,
    cluster: str | None = None,
    progress: Progress = ...,
    method: Literal["paper"] | None = None,
    module: str = "SunPower_SPR_300_WHT__2007__E__",
    mounting: Literal["open-rack", "insulated-back", "close-mount", "auto"] = "auto",
    iam: Literal["module", "physical", "ashrae"] = "module",
    diffuse_iam: bool = False,
    losses: float = 11.4,
    inverter: str | None = "pvwatts",
    dc_ac_ratio: float = 1.0,
    strings: Literal["module", "string"] = "module",
    hidden_walls: Literal["leave-out", "count"] = "leave-out",
    clearance: float = 0.3,
    overhangs: Literal["leave-out", "count"] = "leave-out",
    usable: Mapping[str, float] = ...,
    least_hours: float = 0.0,
    leave_out: StrPath | None = None,
    layout: Literal["rows", "area"] = "rows",
    module_size: str | None = None,
    storey: float = 3.0,
    window_band: float | None = None,
    ground_floor: bool = False,
    facades: StrPath | None = None,
    series: str | Sequence[str] = (),
    monthly: bool = False,
    districts: StrPath | None = None,
    weather: StrPath = "climate",
    time_shift: float = 0.0,
    weather_place: tuple[float, float] | None = None,
    weather_without: Literal["none", "ghi", "dhi", "dni"] = "none",
    allow_distance: float = 150.0,
    weather_point: Literal["nearest", "bilinear"] = "nearest",
    horizon_cut: Literal["measured", "neglect"] = "measured",
    year: int = 2021,
    time_axis: str = "file",
    weather_seed: int = 0,
    sky: Literal["auto", "perez", "isotropic"] = "auto",
    threads: int | None = None,
    private: bool = False,
    way: str | None = None,
    mix: str | None = None,
    step: float | None = None,
    latitudes: tuple[float, float] | None = None,
    longitudes: tuple[float, float] | None = None,
    years: Sequence[int] = (),
    surfaces: int | None = None,
    off_land: str = "blank",
    pictures: bool = True,
) -> xr.Dataset:
    """Full load hours of traced districts at every place of a weather grid.

    Parameters
    ----------
    environments : list of str
        As of ``citypv world``: results of ``suns="sky-grid:N"``, NAME=PATH, or unshaded.
    out : path-like, optional
        Folder to write, with pictures; by default none is kept.
    overwrite, cluster, progress
        As in `simulate`.
    **settings
        As the options of ``citypv world``, with underscores.

    Returns
    -------
    xarray.Dataset
        Of world.nc.

    Other Parameters
    ----------------
    method : {'paper'}, optional
        settings as in the paper (docs/reference/method_paper.md); others take precedence
    module : str, default 'SunPower_SPR_300_WHT__2007__E__'
        module: name, or part of it, in pvlib's Sandia or CEC library
    mounting : {'open-rack', 'insulated-back', 'close-mount', 'auto'}, default 'auto'
        mounting of the modules, which determines the cell temperature
    iam : {'module', 'physical', 'ashrae'}, default 'module'
        incidence angle modifier of direct light
    diffuse_iam : bool, default False
        incidence angle modifier of diffuse light, too
    losses : float, default 11.4
        [%] DC energy lost to soiling, mismatch, wiring, outages …
    inverter : str, default 'pvwatts'
        pvwatts, an inverter of pvlib's library, or none
    dc_ac_ratio : float, default 1.0
        nominal power of modules over that of the inverter
    strings : {'module', 'string'}, default 'module'
        what has a maximum power point of its own; what strings lose in shade is told with
        either
    hidden_walls : {'leave-out', 'count'}, default 'leave-out'
        whether wall area that a neighbour covers counts
    clearance : float, default 0.3
        [m] room before a module, up to a face turned against it
    overhangs : {'leave-out', 'count'}, default 'leave-out'
        whether walls that lean outward by more than 1° are facades
    usable : dict of str to float, default {}
        share that is left to modules by what the city does not show, by kind
    least_hours : float, default 0.0
        [h] full load hours of a long-term year below which a face carries no modules
    leave_out : str, optional
        faces or buildings that carry no modules, such as protected ones: id,words
    layout : {'rows', 'area'}, default 'rows'
        how modules are laid out on what counts
    module_size : str, optional
        [m] length and width of a module; default: the product's
    storey : float, default 3.0
        [m] height of storeys where no windows are drawn
    window_band : float, optional
        [m] height of the windows of each storey where none are drawn; auto: 1.4, but 0 where
        --usable gives a share of facades
    ground_floor : bool, default False
        modules on the lowest storey of facades with windows, too
    facades : str, optional
        storey, window_band and usable share by surface id or kind
    series : list of str, default ()
        ids of surfaces whose hourly series are written to series.csv; buildings: power of each
        in timeseries.nc
    monthly : bool, default False
        add monthly full load hours to faces.csv and buildings.csv
    districts : str, optional
        polygons with a name, for sums by district: FILE, or FILE:COLUMN with the names
    weather : path-like or list, default 'climate'
        weather files; climate; clear-sky; pvgis, a typical year; or a service with years:
        pvgis:2005-2023, nasa-power:2015-2023, era5:2019, open-meteo:2019
    time_shift : float, default 0.0
        [min] added to the times of weather files
    weather_place : (float, float), optional
        [°] where the weather was measured; default: as its files say
    weather_without : {'none', 'ghi', 'dhi', 'dni'}, default 'none'
        column of irradiance to ignore; it then follows from the others
    allow_distance : float, default 150.0
        [km] largest distance of the weather from the city
    weather_point : {'nearest', 'bilinear'}, default 'nearest'
        interpolation of gridded weather
    horizon_cut : {'measured', 'neglect'}, default 'measured'
        irradiance with the sun below 2°: kept as measured, or left out
    year : int, default 2021
        calendar year of climate and clear sky
    time_axis : str, default 'file'
        whole hours of a calendar year for sums and series, in a fixed offset from UTC without
        summer time: utc or ±HH:MM; file: the weather's own times
    weather_seed : int, default 0
        seed of the days and hours of the built-in climate
    sky : {'auto', 'perez', 'isotropic'}, default 'auto'
        model of the diffuse sky
    threads : int, optional
        threads; default: all processors
    private : bool, default False
        leave names and addresses of buildings out of all that is written
    """
    ...
