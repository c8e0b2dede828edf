"""Sources of weather that are no files, by their words: climate, clear-sky, and services with their
years.

Loads nothing heavy: words are checked before anything long begins.
"""

import re
from dataclasses import dataclass
from datetime import UTC, datetime

from ..settings.errors import InputError


@dataclass(frozen=True)
class _Service:
    """A service that can be asked for weather."""

    key: str  # its word in --weather
    title: str
    first: int  # first year it has
    licence: str
    words: str  # what it has, for the manual and Blender
    typical: bool = False  # whether it has a typical year, too


SERVICES = (
    _Service(
        "pvgis",
        "PVGIS",
        2005,
        "CC BY 4.0, European Commission, Joint Research Centre",
        "satellites and ERA5; a typical year with the horizon of distant terrain, years without it",
        typical=True,
    ),
    _Service(
        "nasa-power",
        "NASA POWER",
        2001,
        "public domain, NASA Langley Research Center POWER",
        "satellites (CERES, 1°) and MERRA-2, all over the world",
    ),
    _Service(
        "era5",
        "ERA5",
        1940,
        "CC BY 4.0, Copernicus Climate Change Service",
        "reanalysis, 0.25°; needs a key of the Climate Data Store",
    ),
    _Service(
        "open-meteo",
        "Open-Meteo",
        1940,
        "CC BY 4.0, Open-Meteo.com; free for uses without profit",
        "reanalyses (ERA5, ERA5-Land, IFS) at the nearest point",
    ),
)

ASKED_BY_KEY = {one.key: one for one in SERVICES}


@dataclass(frozen=True)
class Asked:
    """A service with the years that are wanted."""

    service: _Service
    first: int = 0  # 0: a typical year
    last: int = 0

    @property
    def typical(self):
        """Whether it is a typical year."""
        return self.first == 0

    @property
    def years(self):
        """The years as text."""
        return f"{self.first}" if self.first == self.last else f"{self.first}-{self.last}"

    @property
    def text(self):
        """As it is written in --weather."""
        return self.service.key if self.typical else f"{self.service.key}:{self.years}"


def parse_asked(text):
    """Asked of a word of --weather, None where it names no service.

    Raises
    ------
    InputError
        Years that no service can have, or none where they are needed.
    """
    key, colon, years = str(text).partition(":")
    service = ASKED_BY_KEY.get(key)
    if service is None:
        return None
    option = f"--weather {text}"
    if not colon and service.typical:
        return Asked(service)
    last_year = datetime.now(UTC).year - 1
    example = f"give {service.key}:{last_year - 3} or {service.key}:{last_year - 7}-{last_year - 3}"
    years_match = re.fullmatch(r"(\d{4})(?:-(\d{4}))?", years)
    if not years_match:
        problem = "has no typical year" if not colon else f"{years!r} are no years"
        raise InputError(option, problem, example)
    first, last = int(years_match[1]), int(years_match[2] or years_match[1])
    if first > last:
        raise InputError(option, "ends before it begins", f"give {service.key}:{last}-{first}")
    if first < service.first or last > last_year:
        problem = f"{service.title} has whole years from {service.first} to {last_year} at most"
        raise InputError(option, problem, "give years among them")
    return Asked(service, first, last)


def is_source(text):
    """Whether a word of --weather names a model or a service; files do not count."""
    return str(text) in ("climate", "clear-sky") or str(text).partition(":")[0] in ASKED_BY_KEY
