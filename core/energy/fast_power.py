"""DC and AC power of many surfaces from tables made with pvlib: the same numbers, ten times as fast."""

from dataclasses import dataclass

import numpy as np

from .pick_inverter import convert_power
from .pick_module import SANDIA
from .power_model import dc_power, diffuse_share, incidence_factor

HIGHEST = 3000.0  # [Wm⁻²] of effective irradiance
IRRADIANCE_NODES = 16384  # uniform in its square root: dense at low light, where efficiency changes fast
COLDEST, HOTTEST = -40.0, 90.0  # [°C] of cells
MIDDLE, HALF = (COLDEST + HOTTEST) / 2, (HOTTEST - COLDEST) / 2
TERMS = {SANDIA: 3}  # of the polynomial in cell temperature; power of the Sandia model is almost one of degree two
MOST_TERMS = 5
ANGLE_NODES = 65536  # uniform in √(1 - cosine), which is proportional to the angle near normal incidence
MOST_POWER, POWER_NODES = 2.0, 65536  # capacity factors of the inverter's table, uniform in their square root


@dataclass
class FastPower:
    """Tabulated models of one system."""

    incidence: np.ndarray  # (a,) float32, IAM of direct light, over √(1 - cosine of the angle of incidence)
    efficiency: np.ndarray  # (c, e) float32 [W⁻¹m²], capacity factor per effective irradiance: 1, T, T² … (T scaled)
    diffuse_share: np.float32  # FD, the share of diffuse light that the module uses
    conversion: np.ndarray  # (p,) float32, AC power over DC power, over the capacity factor

    def dc(self, poa_direct, poa_diffuse, diffuse_taken, aoi_projection, hours):
        """Capacity factor of surfaces at hours.

        Parameters
        ----------
        poa_direct, poa_diffuse : numpy.ndarray, (h, n) float32
            Irradiance on the surfaces [Wm⁻²].
        diffuse_taken : numpy.ndarray, (h, n) float32
            Diffuse irradiance after its incidence angle modifier [Wm⁻²].
        aoi_projection : numpy.ndarray, (h, n) float32
            Cosine of the angle of incidence, from 0 to 1; overwritten.
        hours : Hours
            The h hours, in float32.

        Returns
        -------
        numpy.ndarray, (h, n) float32
        """
        # Effective irradiance: f₁ (poa_direct f₂ + FD diffuse_taken).
        np.subtract(np.float32(1), aoi_projection, out=aoi_projection)
        np.sqrt(np.maximum(aoi_projection, 0, out=aoi_projection), out=aoi_projection)
        effective = look_up(self.incidence, aoi_projection, np.float32(ANGLE_NODES - 1))[0]
        effective *= poa_direct
        temperature = np.multiply(diffuse_taken, self.diffuse_share, out=aoi_projection)
        effective += temperature
        effective *= hours.spectral_factor
        np.maximum(effective, 0, out=effective)  # visible shares between days may overshoot a little below 0
        # Cell temperature: air plus heating in proportion to irradiance; scaled to -1 to 1 over the table's range.
        np.add(poa_direct, poa_diffuse, out=temperature)
        temperature *= hours.heating / np.float32(HALF)
        temperature += (hours.temp_air - np.float32(MIDDLE)) / np.float32(HALF)
        # Power: irradiance times a polynomial in the cell temperature.
        scale = np.float32((IRRADIANCE_NODES - 1) / np.sqrt(HIGHEST))
        *rest, power = look_up(self.efficiency, np.sqrt(effective), scale)
        for term in reversed(rest):
            power *= temperature
            power += term
        power *= effective
        return power

    def ac(self, power):
        """AC power over nominal DC power, from the capacity factor: (h, n) float32."""
        scale = np.float32((POWER_NODES - 1) / np.sqrt(MOST_POWER))
        power = np.maximum(power, 0)
        return power * look_up(self.conversion, np.sqrt(power), scale)[0]


def tabulate_power(system):
    """Tabulate pvlib's models of a system.

    At a given effective irradiance power is a smooth function of cell temperature, so a polynomial through three
    (Sandia) or five (CEC) temperatures is accurate. Power over irradiance changes slowly, so that the nearest node is
    close enough.

    Parameters
    ----------
    system : PvSystem

    Returns
    -------
    FastPower
    """
    cosine = 1.0 - np.linspace(0.0, 1.0, ANGLE_NODES) ** 2
    incidence = incidence_factor(np.degrees(np.arccos(cosine)), system)
    root = np.linspace(0.0, np.sqrt(HIGHEST), IRRADIANCE_NODES)
    irradiance = np.maximum(root, root[1] / 2) ** 2  # the first node represents all values below half a step
    terms = TERMS.get(system.module.library, MOST_TERMS)
    nodes = np.cos(np.pi * (np.arange(terms) + 0.5) / terms)  # Chebyshev nodes, for the smallest error in between
    temperature = np.broadcast_to(MIDDLE + HALF * nodes[:, None], (terms, IRRADIANCE_NODES))
    power = dc_power(np.broadcast_to(irradiance, temperature.shape), temperature, system.module)
    efficiency = np.linalg.solve(np.vander(nodes, terms, increasing=True), power / irradiance)
    return FastPower(
        incidence.astype(np.float32),
        efficiency.astype(np.float32),
        np.float32(diffuse_share(system)),
        tabulate_conversion(system).astype(np.float32),
    )


def tabulate_conversion(system):
    """AC power over DC power of a system at the nodes of its capacity factor: (p,)."""
    root = np.linspace(0.0, np.sqrt(MOST_POWER), POWER_NODES)
    power = np.maximum(root, root[1] / 2) ** 2
    fed = power * (1.0 - system.losses / 100.0)
    return (fed if system.inverter is None else convert_power(fed, system.inverter)) / power


def look_up(table, values, scale):
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
    place = values * scale
    place += np.float32(0.5)
    node = place.astype(np.intp)
    return [np.take(column, node, mode="clip") for column in np.atleast_2d(table)]
