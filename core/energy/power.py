"""Power of a module from the light on it: one arithmetic, whose curves are pvlib's own or tables
made with pvlib.

    direct × IAM(aoi) + FD × diffuse     × f₁ (spectrum)  = effective irradiance ─┐
    air temperature + heating × (direct + diffuse)        = cell temperature     ─┴► DC power ─► losses, inverter ─► AC

Few surfaces are computed by pvlib itself, many by tables, which give the same numbers ten times as
fast: at a given effective irradiance power is a smooth function of cell temperature, so that a
polynomial through three (Sandia) or five (CEC) temperatures is accurate, and power over irradiance
changes so slowly that the nearest node is close enough.

References
----------
D. L. King, W. E. Boyson, J. A. Kratochvil (2004), Photovoltaic array performance model,
SAND2004-3535. :doi:`10.2172/919131`
"""

from dataclasses import dataclass

import numpy as np
import pvlib
from scipy.interpolate import PchipInterpolator

from .pv_system import MOUNTINGS, PVWATTS, SANDIA, PvSystem

HIGHEST = 3000.0  # [Wm⁻²] of effective irradiance
# uniform in its square root: dense at low light, where efficiency changes fast
IRRADIANCE_NODES = 16384
COLDEST, HOTTEST = -40.0, 90.0  # [°C] of cells
MIDDLE, HALF = (COLDEST + HOTTEST) / 2, (HOTTEST - COLDEST) / 2
# uniform in √(1 - cosine), which is proportional to the angle near normal incidence
ANGLE_NODES = 65536


# -- the curves of a system, by pvlib --


def diffuse_incidence_factors(surface_tilt, system, sources=(), *, tilt_step=3.0):
    """IAM of the light from the sky, of reflected light, and of the light of traced parts of the
    sky.

    Sky and ground are assumed to be uniform (Marion 2017, :doi:`10.1016/j.solener.2017.02.027`) and
    unobstructed; light reflected by walls is treated like light from the ground.

    Parameters
    ----------
    surface_tilt : numpy.ndarray, (n,)
        [°]
    system : PvSystem
    sources : sequence of HorizonBand
        k of them.

    Returns
    -------
    numpy.ndarray, (2 + k, n)
        1 if the system has no IAM for diffuse light.
    """
    if not (system.diffuse_incidence and system.aoi):
        return np.ones((2 + len(sources), len(surface_tilt)))
    # pvlib integrates the glass over sky, ground and horizon at some tilts; smooth in between.
    # `tilt_step`: [°] between the tilts whose diffuse IAM is integrated; cubic interpolation in
    # between.
    tilt = np.arange(0.0, 180.0 + tilt_step, tilt_step)
    own = {"module": system.module.parameters} if system.incidence == "sapm" else {}
    factors = pvlib.iam.marion_diffuse(system.incidence, tilt, **own)
    regions = ("sky", "ground", *(source.incidence for source in sources))
    # (2 + k, t); 0 where one is not visible
    shares = np.nan_to_num([factors[region] for region in regions])
    return PchipInterpolator(tilt, shares, axis=1)(np.clip(surface_tilt, 0.0, 180.0))


def conditions_of_modules(data, system):
    """What the air does to modules at some hours.

    Parameters
    ----------
    data : pandas.DataFrame
        h hours of a Weather.
    system : PvSystem

    Returns
    -------
    spectral_factor : (h,) float
        Of `spectral_factor`, at the absolute air mass.
    dark, slope : (h,) and (h, m) float
        Of `_cell_heating`.
    """
    relative = pvlib.atmosphere.get_relative_airmass(
        data["apparent_zenith"].to_numpy(float), "kastenyoung1989"
    )
    pressure, *air = (data[name].to_numpy(float) for name in ("pressure", "temp_air", "wind_speed"))
    airmass = pvlib.atmosphere.get_absolute_airmass(relative, pressure)
    return spectral_factor(airmass, system), *_cell_heating(*air, system)


def spectral_factor(airmass, system):
    """Sandia's f₁, the influence of the spectrum on the current; 1 for modules of the CEC library,
    which has none.

    Parameters
    ----------
    airmass : numpy.ndarray
        Absolute air mass; NaN with the sun below the horizon.
    system : PvSystem

    Returns
    -------
    numpy.ndarray
        0 with the sun below the horizon, as in pvlib. Held constant beyond an air mass of 10 (sun
        below 5.4°).
    """
    if system.module.library != SANDIA:
        return np.ones_like(airmass)
    if not system.spectrum:
        return np.where(np.isnan(airmass), 0.0, 1.0)
    # The coefficients of f₁ were fitted up to an air mass of 10; beyond, the polynomials diverge.
    return pvlib.spectrum.spectral_factor_sapm(np.minimum(airmass, 10.0), system.module.parameters)


def _cell_heating(temp_air, wind_speed, system):
    """Cell temperature by the Sandia model, which is linear in the irradiance.

    Parameters
    ----------
    temp_air, wind_speed : numpy.ndarray, (h,)
        [°C], [ms⁻¹]
    system : PvSystem

    Returns
    -------
    dark : numpy.ndarray
        [°C] without irradiance: as the air, or as at standard test conditions with the effect
        switched off.
    slope : numpy.ndarray, (h, m)
        [Km²W⁻¹] per irradiance on the plane, of each of the system's `mountings`.
    """
    if not system.temperature:
        return np.full_like(temp_air, 25.0), np.zeros((len(temp_air), len(system.mountings)))
    # T_cell = T_air + slope · irradiance, with a slope for each way of mounting at this wind speed.
    slopes = [
        pvlib.temperature.sapm_cell(1.0, 0.0, wind_speed, **MOUNTINGS[name])
        for name in system.mountings
    ]
    return temp_air, np.stack(slopes, axis=1)


def dc_power(effective, temp_cell, module):
    """Power at the maximum power point over nominal power (paper, Eq. 12).

    Parameters
    ----------
    effective : numpy.ndarray
        Effective irradiance, above 0 [Wm⁻²].
    temp_cell : numpy.ndarray
        [°C]
    module : Module

    Returns
    -------
    numpy.ndarray
        By the Sandia array performance model, or by the single-diode model with CEC parameters.
    """
    # pvlib's Sandia model, or its single diode whose five parameters follow light and temperature.
    own = module.parameters
    if module.library == SANDIA:
        return pvlib.pvsystem.sapm(effective, temp_cell, own)["p_mp"] / module.nominal_power
    names = ("alpha_sc", "a_ref", "I_L_ref", "I_o_ref", "R_sh_ref", "R_s", "Adjust")
    diode = pvlib.pvsystem.calcparams_cec(
        effective, temp_cell, **{name: own[name] for name in names}
    )
    return pvlib.pvsystem.max_power_point(*diode, method="newton")["p_mp"] / module.nominal_power


def ac_power(power, system, *, efficiency=0.96):
    """AC power after losses and the inverter, both over nominal DC power; DC power itself without
    either.

    An inverter has as many modules as its size requires, and its nominal input voltage: strings are
    assumed to fit. Consumption at night is neglected.
    """
    # Losses come off first; the inverter then takes DC power in units of its own size, and gives
    # back AC power in the modules'.
    inverter = system.inverter
    power = (
        np.maximum(power, 0) * (1.0 - system.losses / 100.0) if system.losses or inverter else power
    )
    if inverter is None:
        return power
    if inverter.name == PVWATTS:
        # `efficiency`: of PVWatts' inverter at full load (Dobos 2014, NREL/TP-6A20-62641).
        fed = pvlib.inverter.pvwatts(power, 1.0 / inverter.dc_ac_ratio / efficiency, efficiency)
    else:
        # [W] of modules
        own, size = (
            inverter.parameters,
            inverter.parameters["Paco"] * inverter.dc_ac_ratio,
        )
        fed = np.maximum(pvlib.inverter.sandia(own["Vdco"], power * size, own), 0.0) / size
    return fed.astype(power.dtype, copy=False)


# -- the arithmetic --


def dc_factor(curves, direct, diffuse, diffuse_taken, aoi_projection, *, hours, mounting):
    """DC power over nominal power of surfaces at hours.

    Parameters
    ----------
    curves : PvlibCurves or PowerTables
    direct, diffuse : numpy.ndarray, (h, n)
        Irradiance on the surfaces [Wm⁻²].
    diffuse_taken : numpy.ndarray, (h, n)
        Diffuse irradiance after its incidence angle modifier [Wm⁻²].
    aoi_projection : numpy.ndarray, (h, n)
        Cosine of the angle of incidence, not negative; overwritten.
    hours : Hours
        The h hours, in the precision of the arrays.
    mounting : numpy.ndarray, (n,) int
        Column of `hours.heating` of each surface.

    Returns
    -------
    numpy.ndarray, (h, n)
    """
    # Effective irradiance: (IAM(aoi) · direct + FD · diffuse after its IAM) · f₁ [Wm⁻²]. Arrays are
    # reused for the next step, as they are the largest of a run.
    effective = curves.incidence_at(aoi_projection)
    effective *= direct
    effective += np.multiply(diffuse_taken, curves.diffuse_share, out=aoi_projection)
    effective *= hours.spectral_factor
    # visible shares between days may overshoot a little below 0
    np.maximum(effective, 0, out=effective)
    # Cell temperature: air + heating · irradiance on the plane [°C].
    temp_cell = np.add(direct, diffuse, out=aoi_projection)
    temp_cell *= np.take(hours.heating, mounting, axis=1)
    temp_cell += hours.temp_air
    return curves.power_at(effective, temp_cell)


@dataclass(frozen=True)
class PvlibCurves:
    """The curves of a system, by pvlib itself."""

    system: PvSystem

    @property
    def diffuse_share(self):
        """Share FD of diffuse light that the module uses: below 1 for concentrators of the Sandia
        library.
        """
        module = self.system.module
        return module.parameters["FD"] if module.library == SANDIA else 1.0

    def incidence_at(self, aoi_projection):
        """IAM of direct light, by the cosine of the angle of incidence; 1 with the effect switched
        off.

        Sandia's polynomial f₂ of the module, Fresnel's equations for a pane (De Soto et al. 2006),
        or ASHRAE's law.
        """
        if not self.system.aoi:
            return np.ones_like(aoi_projection)
        aoi = np.degrees(np.arccos(np.minimum(aoi_projection, 1.0)))
        if self.system.incidence == "sapm":
            return pvlib.iam.sapm(aoi, self.system.module.parameters)
        return {"physical": pvlib.iam.physical, "ashrae": pvlib.iam.ashrae}[self.system.incidence](
            aoi
        )

    def power_at(self, effective, temp_cell):
        """DC power over nominal power, 0 without effective irradiance."""
        lit, power = effective > 0, np.zeros_like(effective)
        power[lit] = dc_power(effective[lit], temp_cell[lit], self.system.module)
        return power


@dataclass
class PowerTables:
    """The curves of a system as tables; the nearest node gives the value."""

    # (a,) float32, IAM of direct light, over √(1 - cosine of the angle of incidence)
    incidence: np.ndarray
    # (c, e) float32 [W⁻¹m²], DC power per effective irradiance: 1, T, T² … (T scaled)
    efficiency: np.ndarray
    diffuse_share: np.float32  # FD, the share of diffuse light that the module uses
    system: PvSystem

    def incidence_at(self, aoi_projection):
        """IAM of direct light; overwrites the cosine of the angle of incidence."""
        # √(1 - cosine) is the coordinate of the table, from 0 head-on to 1 along the surface.
        np.subtract(np.float32(1), aoi_projection, out=aoi_projection)
        np.sqrt(np.maximum(aoi_projection, 0, out=aoi_projection), out=aoi_projection)
        return _look_up(self.incidence, aoi_projection, self.scales[0])[0]

    @property
    def scales(self):
        """Nodes per unit of √(1 - cosine) and of √irradiance, and the last node of these:
        float32.
        """
        root = (IRRADIANCE_NODES - 1) / np.sqrt(HIGHEST)
        return np.float32(ANGLE_NODES - 1), np.float32(root), np.float32(IRRADIANCE_NODES - 1)

    def scale_heating(self, dark, slope):
        """Cell temperature per irradiance, and without any, on the scale of the tables, -1 to 1:
        (h, 2) float32 of two (h,) [°C].
        """
        return np.stack([slope / HALF, (dark - MIDDLE) / HALF], axis=1).astype(np.float32)

    def power_at(self, effective, temp_cell):
        """DC power over nominal power: irradiance times a polynomial in the cell temperature, which
        is overwritten.
        """
        # Cell temperature scaled to -1 to 1 over the range of the table.
        temp_cell -= np.float32(MIDDLE)
        temp_cell /= np.float32(HALF)
        # Coefficients of the polynomial at the nearest irradiance, summed by Horner's rule.
        *rest, power = _look_up(self.efficiency, np.sqrt(effective), self.scales[1])
        for term in reversed(rest):
            power *= temp_cell
            power += term
        power *= effective
        return power


def tabulate_power(system):
    """Tabulate the curves of a PvSystem: PowerTables."""
    exact = PvlibCurves(system)
    # IAM over √(1 - cosine), so that nodes are dense where it changes.
    incidence = exact.incidence_at(1.0 - np.linspace(0.0, 1.0, ANGLE_NODES) ** 2)
    root = np.linspace(0.0, np.sqrt(HIGHEST), IRRADIANCE_NODES)
    # the first node represents all values below half a step
    irradiance = np.maximum(root, root[1] / 2) ** 2
    # At each irradiance the polynomial through power at some temperatures, per irradiance.
    # Terms of the polynomial in cell temperature: power of the Sandia model is almost one of degree
    # two.
    terms = {SANDIA: 3}.get(system.module.library, 5)
    # Chebyshev nodes, for the smallest error in between
    nodes = np.cos(np.pi * (np.arange(terms) + 0.5) / terms)
    temperature = np.broadcast_to(MIDDLE + HALF * nodes[:, None], (terms, IRRADIANCE_NODES))
    power = dc_power(np.broadcast_to(irradiance, temperature.shape), temperature, system.module)
    efficiency = np.linalg.solve(np.vander(nodes, terms, increasing=True), power / irradiance)
    single = incidence.astype(np.float32), efficiency.astype(np.float32)
    return PowerTables(*single, np.float32(exact.diffuse_share), system)


def _look_up(table, values, scale):
    """Entries of the nodes nearest to some values.

    Parameters
    ----------
    table : numpy.ndarray, (t,) or (c, t)
        Values at nodes 0, 1/scale, 2/scale, …
    values : numpy.ndarray, (h, n) float32
        Not negative.
    scale : numpy.float32
        Nodes per unit.

    Returns
    -------
    list of numpy.ndarray, (h, n)
        One for each column of the table.
    """
    # The nearest node, by rounding half up.
    place = values * scale
    place += np.float32(0.5)
    node = place.astype(np.intp)
    return [np.take(column, node, mode="clip") for column in np.atleast_2d(table)]
