"""What the user asks for: all settings of a run, with their defaults."""

from dataclasses import asdict, dataclass, field

from .errors import InputError

ESTIMATORS = ("gather", "forward")


@dataclass
class Request:
    """Settings of a run; the command line and the panel fill them in."""

    # what is read
    lod: str | None = None  # None: the best 2.x of each building
    unit: str = "m"  # of OBJ files: m, ft, us-ft
    up: str = "z"  # of OBJ files: z, y
    latitude: float | None = None  # [°], overrides the coordinate reference system
    longitude: float | None = None  # [°]
    grid_size: float | None = None  # [m], splits large polygons into cells
    patch_size: float | None = 10.0  # [m], longest edge of a patch of light; None keeps the triangles as they are
    ground: str = "auto"  # auto, none
    terrain: str | None = None  # file of measured ground, takes the place of the generated one
    # the weather
    weather: str = "clear-sky"  # or a file
    weather_point: str = "nearest"  # or bilinear
    year: int = 2021  # of the clear sky
    # the light
    suns: str = "typical-days:12"  # or hourly, sky-grid:N
    max_bounces: int | None = 3  # None: chosen by the plan
    albedo: float = 0.25
    ground_albedo: float = 0.25
    albedo_file: str | None = None
    materials: dict = field(default_factory=dict)  # name of a material -> light.materials.MaterialSpec
    file_materials: bool = False  # whether materials that the city's files name tell the albedo of their surfaces
    ground_material: str = ""  # name of the generated ground's among them
    far_ground: bool = True
    estimator: str = ESTIMATORS[0]  # how light is followed
    samples: int = 256  # hemisphere rays per patch; forward: photons per patch from each source
    shadow_samples: int = 16  # points per patch from which each sun is looked for
    effects: dict = field(default_factory=dict)  # key -> bool, overrules the plan
    seed: int = 0
    threads: int | None = None  # None: all processors
    # the electricity
    module: str = "SunPower_SPR_300_WHT__2007__E__"

    def as_dict(self):
        """All settings by name."""
        return asdict(self)


def check_request(request):
    """Refuse settings that mean nothing.

    Raises
    ------
    InputError
        Names the option and its allowed values.
    """
    for option, value in (("--albedo", request.albedo), ("--ground-albedo", request.ground_albedo)):
        if not 0 <= value <= 1:
            raise InputError(option, f"{value} is not a share of light", "give a number from 0 to 1")
    if request.estimator not in ESTIMATORS:
        raise InputError("--estimator", f"{request.estimator!r} is not known", f"give {' or '.join(ESTIMATORS)}")
    bounces = request.max_bounces
    if bounces is not None and not (bounces >= 0 and float(bounces).is_integer()):
        problem = f"{bounces} is {'negative' if bounces < 0 else 'not a whole number'}"
        raise InputError("--max-bounces", problem, "give auto, 0 or more")
    for option, value, least in (("--samples", request.samples, 4), ("--shadow-samples", request.shadow_samples, 1)):
        if not (value >= least and float(value).is_integer()):
            problem = f"{value} is {'too few' if value < least else 'not a whole number'}"
            raise InputError(option, problem, f"give {least} or more")
    threads = request.threads
    if threads is not None and not (threads >= 1 and float(threads).is_integer()):
        problem = f"{threads} is {'too few' if threads < 1 else 'not a whole number'}"
        raise InputError("--threads", problem, "give 1 or more")
    for option, value in (("--grid-size", request.grid_size), ("--patch-size", request.patch_size)):
        if value is not None and not value > 0:
            raise InputError(option, f"{value} is not a length", "give metres above 0")
    if request.latitude is not None and not -90 <= request.latitude <= 90:
        raise InputError("--latitude", f"{request.latitude} is beyond the poles", "give degrees from -90 to 90")
    if request.longitude is not None and not -180 <= request.longitude <= 180:
        raise InputError("--longitude", f"{request.longitude} is off the map", "give degrees from -180 to 180")
