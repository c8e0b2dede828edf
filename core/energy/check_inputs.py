"""Refuse an invalid Transfer or Weather."""

import numpy as np

from ..settings.errors import UNIT, InputError, check_array, check_unit
from ..sky.horizon_band import SOURCES
from ..sky.sky_models import sources_of
from ..weather.check_weather import LIMITS

POSITIVE, SHARE = {"least": 0}, {"least": 0, "most": 1 + UNIT}


def check_transfer(transfer):
    """Refuse a Transfer whose arrays do not fit together, or hold what is not a number.

    A standard error may be NaN: unknown.

    Parameters
    ----------
    transfer : Transfer

    Raises
    ------
    InputError
    """
    transfer.suns.check()
    # Suns and surfaces: unit normals, one value a surface.
    surfaces, count = transfer.surfaces, len(transfer.surfaces)
    normal = check_array("normal", surfaces.normal, (count, 3), least=-1 - UNIT, most=1 + UNIT)
    check_unit("normal", normal[normal.any(axis=1)])  # zero for surfaces without area
    check_array("eligible", surfaces.eligible, (count,), kind="b")
    for name in ("kind", "orientation"):
        if np.shape(getattr(surfaces, name)) != (count,):
            raise InputError(
                name,
                f"shape {np.shape(getattr(surfaces, name))}",
                f"give an array of shape ({count},)",
            )
    # Light of surfaces, of each sun, and its errors, with shape and bounds of each.
    single, of_suns = (count,), (count, len(transfer.suns))
    arrays = {
        "area": (surfaces.area, single, POSITIVE),
        "diffuse_relative": (transfer.diffuse_relative, single, POSITIVE),
        "visible_share": (transfer.visible_share, of_suns, SHARE),
        "direct_reflected": (transfer.direct_reflected, of_suns, POSITIVE),
    }
    arrays |= {
        name: (getattr(transfer, name), single, SHARE)
        for name in ("covered_share", "sky_view_factor", "far_ground_view_factor")
    }
    for name in ("diffuse_relative_standard_error", "direct_annual_standard_error"):
        arrays[name] = np.nan_to_num(getattr(transfer, name), posinf=np.inf), single, POSITIVE
    for name, light in transfer.sources.items():
        for field, values in vars(light).items():
            arrays[SOURCES[name].variable(field)] = (
                values,
                single,
                SHARE if field == "view_factor" else POSITIVE,
            )
    # What only some runs have.
    if transfer.no_room is not None:
        arrays["no_room"] = transfer.no_room, (count, len(transfer.clearances)), SHARE
    if transfer.taken_parts is not None and transfer.taken_parts.shape != transfer.no_room.shape:
        problem = f"shape {transfer.taken_parts.shape}"
        raise InputError("taken_parts", problem, f"give an array of shape {transfer.no_room.shape}")
    if transfer.string_loss is not None:
        arrays["string_loss"] = transfer.string_loss, (*of_suns, "d"), {}
    if transfer.left_out is not None:
        arrays["left_out"] = transfer.left_out, (count,), SHARE
    for name in (
        (
            "diffuse_passed_on",
            "direct_passed_on",
            "diffuse_discretisation",
            "direct_discretisation",
            "covariance",
        )
        if transfer.error_parts is not None
        else ()
    ):
        arrays[name] = (
            getattr(transfer.error_parts, name),
            (count, "r") if name.endswith("passed_on") else single,
            {},
        )
    # Each array in its shape and bounds.
    for name, (values, shape, bounds) in arrays.items():
        check_array(name, values, shape, **bounds)
    if not 0 <= transfer.ground_albedo <= 1:
        raise InputError("ground_albedo", f"{transfer.ground_albedo}", "give a number from 0 to 1")


def check_sky(transfer, sky, source="the Transfer"):
    """Refuse a model of the sky that needs light that was not traced; `source` is the Transfer's,
    for the message.

    Raises
    ------
    InputError
    """
    missing = " and ".join(
        part.title for part in sources_of(sky) if part.name not in transfer.sources
    )
    if missing:
        raise InputError(
            f"--sky {sky}",
            f"{source} was traced without the light of {missing}",
            "trace the city again with this sky, or give --sky isotropic",
        )


def check_string_settings(request):
    """Refuse to count what strings lose in shade where the run will not know it.

    Raises
    ------
    InputError
    """
    if request.strings != "string":
        return
    option, cure = "--strings string", "or give --strings module"
    if request.layout != "rows":
        raise InputError(option, "needs modules in rows", f"give --layout rows, {cure}")
    if request.estimator == "forward":
        raise InputError(option, "is not known by photons", f"use --estimator gather, {cure}")
    if not request.effects.get("string-shade", True):
        raise InputError(option, "is switched off by --effects", f"leave that out, {cure}")


def check_strings(transfer, system):
    """Refuse to count what strings lose in shade where it is unknown.

    Raises
    ------
    InputError
    """
    if system.strings == "string" and transfer.string_loss is None:
        problem = "what strings lose in shade was not traced"
        cure = "trace the city again, by gather and with modules in rows, or give --strings module"
        raise InputError("--strings string", problem, cure)


def check_hours(weather):
    """Refuse a Weather with missing columns or impossible values.

    Parameters
    ----------
    weather : Weather

    Raises
    ------
    InputError
    """
    weather.axis.check()
    count = len(weather.data)
    if not count:
        raise InputError("weather", "it has no hours", "give one or more full years")
    for name in (*LIMITS, "apparent_zenith", "solar_azimuth"):
        if name not in weather.data.columns:
            raise InputError("weather", f"no column {name}", "complete it with add_sun")
        least, most, _ = LIMITS.get(name, (-360.0, 360.0, "°"))
        values = weather.data[name].to_numpy()
        words = f"{weather.columns.get(name, name)} of the weather"
        check_array(words, values, (count,), least=least, most=most, row="hour")
