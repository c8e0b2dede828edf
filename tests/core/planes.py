"""What pvlib alone makes of planes: light, cell temperature and power."""

import numpy as np
import pvlib
from weathers import HOUR

ALBEDO = 0.25
DC = {"losses": 0.0, "inverter": None, "mounting": "open-rack"}  # settings of the modules alone
SANDIA = "SunPower_SPR_300_WHT__2007__E__"


def light_on_plane(data, tilt, azimuth, sky="isotropic"):
    """Direct, diffuse and ground irradiance [Wm⁻²] of hourly weather, and the angle of incidence
    [°].

    The Perez sky is isotropic with the sun below the horizon.
    """
    sun = data["apparent_zenith"], data["solar_azimuth"]
    direct = pvlib.irradiance.beam_component(tilt, azimuth, *sun, data["dni"])
    diffuse = pvlib.irradiance.isotropic(tilt, data["dhi"])
    if sky == "perez":
        extra = pvlib.irradiance.get_extra_radiation(data.index + HOUR / 2).to_numpy()
        airmass = pvlib.atmosphere.get_relative_airmass(sun[0])
        uneven = pvlib.irradiance.perez(
            tilt, azimuth, data["dhi"], data["dni"], extra, *sun, airmass
        )
        diffuse = uneven.where(airmass.notna() & (data["dhi"] > 0), diffuse)
    horizontal = data["dhi"] + data["dni"] * np.maximum(np.cos(np.radians(sun[0])), 0)
    ground = pvlib.irradiance.get_ground_diffuse(tilt, horizontal, ALBEDO)
    return direct, diffuse, ground, pvlib.irradiance.aoi(tilt, azimuth, *sun)


def spectral_by_pvlib(data, name=SANDIA):
    """Sandia's f₁, constant beyond an air mass of 10."""
    relative = pvlib.atmosphere.get_relative_airmass(data["apparent_zenith"])
    airmass = np.minimum(pvlib.atmosphere.get_absolute_airmass(relative, data["pressure"]), 10)
    return pvlib.spectrum.spectral_factor_sapm(
        airmass, pvlib.pvsystem.retrieve_sam("SandiaMod")[name]
    )


def cell_temperature(data, poa, mounting="open_rack_glass_polymer"):
    parameters = pvlib.temperature.TEMPERATURE_MODEL_PARAMETERS["sapm"][mounting]
    return pvlib.temperature.sapm_cell(poa, data["temp_air"], data["wind_speed"], **parameters)


def sapm_power(effective, temp_cell, name=SANDIA):
    """Capacity factor of a module of the Sandia library."""
    module = pvlib.pvsystem.retrieve_sam("SandiaMod")[name]
    power = pvlib.pvsystem.sapm(effective, temp_cell, module)["p_mp"]
    return power.fillna(0.0) / (module["Impo"] * module["Vmpo"])


def run_chain(
    data, tilt, azimuth, *, name=SANDIA, sky="isotropic", without=(), share=1.0, diffuse=None
):
    """In-plane irradiance [Wm⁻²] and capacity factor of a plane in the open, with some effects of
    modules left out.

    Or of a shaded one, by its visible share of the sun and its diffuse light.
    """
    direct, dome, ground, aoi = light_on_plane(data, tilt, azimuth, sky)
    direct, diffuse = share * direct, dome + ground if diffuse is None else diffuse
    module, factor = pvlib.pvsystem.retrieve_sam("SandiaMod")[name], spectral_by_pvlib(data, name)
    factor = (factor > 0).astype(float) if "spectrum" in without else factor
    taken = direct if "aoi" in without else direct * pvlib.iam.sapm(aoi, module)
    warm = cell_temperature(data, direct + diffuse)
    effective = factor * (taken + module["FD"] * diffuse)
    return direct + diffuse, sapm_power(
        effective, 0 * warm + 25.0 if "temperature" in without else warm, name
    )
