"""The Sandia array performance model from tables made by pvlib: the same numbers, ten times as fast."""

from dataclasses import dataclass

import numpy as np
import pvlib

from .pick_module import nominal_power

STEP = 0.25  # [Wm⁻²] between the nodes of effective irradiance
HIGHEST = 3000.0  # [Wm⁻²]
TEMPERATURES = np.array([-10.0, 30.0, 70.0])  # [°C] through which the parabola of each node passes
ANGLE_NODES = 32768


@dataclass
class SapmTables:
    """One module's model, tabulated."""

    incidence: np.ndarray  # (a,) float32, angle-of-incidence factor f₂ over the cosine of the angle
    efficiency: np.ndarray  # (3, e) float32 [W⁻¹m²], capacity factor per effective irradiance: 1, T, T²
    diffuse_share: float  # FD, the share of diffuse light that is not reflected away


def tabulate_sapm(module):
    """Tabulate pvlib's Sandia model.

    At a given effective irradiance the power is a cubic in the cell temperature whose last term is negligible, so
    three temperatures say all. Power over irradiance changes slowly, so that the nearest node is close enough.

    Parameters
    ----------
    module : dict
        From `pick_module`.

    Returns
    -------
    SapmTables
    """
    cosine = np.linspace(0.0, 1.0, ANGLE_NODES)
    incidence = pvlib.iam.sapm(np.degrees(np.arccos(cosine)), module)
    # The first node stands for irradiances from 0 to half a step.
    irradiance = np.maximum(np.arange(0.0, HIGHEST + STEP, STEP), STEP / 4)
    power = pvlib.pvsystem.sapm(irradiance[None, :], TEMPERATURES[:, None], module)["p_mp"]
    efficiency = power / irradiance / nominal_power(module)
    parabola = np.linalg.solve(np.vander(TEMPERATURES, 3, increasing=True), efficiency)
    return SapmTables(incidence.astype(np.float32), parabola.astype(np.float32), np.float32(module["FD"]))


def fast_sapm(poa_direct, poa_diffuse, aoi_projection, hours, tables):
    """Capacity factor of surfaces at hours, from the tables.

    Parameters
    ----------
    poa_direct, poa_diffuse : numpy.ndarray, (h, n) float32
        Irradiance on the surfaces [Wm⁻²].
    aoi_projection : numpy.ndarray, (h, n) float32
        Cosine of the angle of incidence, from 0 to 1; its values are overwritten.
    hours : Hours
        The h hours, in float32.
    tables : SapmTables

    Returns
    -------
    numpy.ndarray, (h, n) float32
    """
    # Effective irradiance: f₁ (poa_direct f₂ + FD poa_diffuse).
    effective = look_up(tables.incidence, aoi_projection, np.float32(ANGLE_NODES - 1))[0]
    effective *= poa_direct
    temp_cell = np.multiply(poa_diffuse, tables.diffuse_share, out=aoi_projection)
    effective += temp_cell
    effective *= hours.spectral_factor
    # Cell temperature: air, and heating in proportion to the irradiance.
    np.add(poa_direct, poa_diffuse, out=temp_cell)
    temp_cell *= hours.heating
    temp_cell += hours.temp_air
    # Power: irradiance times a parabola in the cell temperature.
    constant, slope, power = look_up(tables.efficiency, effective, np.float32(1.0 / STEP))
    power *= temp_cell
    power += slope
    power *= temp_cell
    power += constant
    power *= effective
    return power


def look_up(table, values, scale):
    """Entries of the nodes nearest to some values.

    Parameters
    ----------
    table : numpy.ndarray, (t,) or (c, t)
        Over nodes 0, 1/scale, 2/scale, …
    values : numpy.ndarray, (h, n) float32
        Not negative.
    scale : numpy.float32
        Nodes per unit.

    Returns
    -------
    list of numpy.ndarray, (h, n)
        One of each column of the table.
    """
    place = values * scale
    place += np.float32(0.5)
    node = place.astype(np.intp)
    return [np.take(column, node, mode="clip") for column in np.atleast_2d(table)]
