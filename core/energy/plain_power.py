"""DC and AC power of few surfaces: pvlib is called for every surface and hour."""

from dataclasses import dataclass

import numpy as np

from .pick_inverter import convert_power
from .power_model import cell_temperature, dc_power, diffuse_share, incidence_factor
from .pv_system import PvSystem


@dataclass(frozen=True)
class PlainPower:
    """DC and AC power of a system, by pvlib."""

    system: PvSystem

    def dc(self, poa_direct, poa_diffuse, diffuse_taken, aoi_projection, hours):
        """Capacity factor of surfaces at hours.

        Parameters
        ----------
        poa_direct, poa_diffuse : numpy.ndarray, (h, n)
            Irradiance on the surfaces [Wm⁻²].
        diffuse_taken : numpy.ndarray, (h, n)
            Diffuse irradiance after its incidence angle modifier [Wm⁻²].
        aoi_projection : numpy.ndarray, (h, n)
            Cosine of the angle of incidence, not negative.
        hours : Hours
            The h hours.

        Returns
        -------
        numpy.ndarray, (h, n)
            0 without effective irradiance.
        """
        system = self.system
        aoi = np.degrees(np.arccos(np.minimum(aoi_projection, 1.0)))
        direct = poa_direct * incidence_factor(aoi, system)
        effective = hours.spectral_factor * (direct + diffuse_share(system) * diffuse_taken)
        temp_cell = cell_temperature(poa_direct + poa_diffuse, hours.temp_air, hours.wind_speed, system)
        lit = effective > 0
        power = np.zeros_like(effective)
        power[lit] = dc_power(effective[lit], temp_cell[lit], system.module)
        return power

    def ac(self, power):
        """AC power over nominal DC power, from the capacity factor: (h, n)."""
        power = np.maximum(power, 0.0) * (1.0 - self.system.losses / 100.0)
        return power if self.system.inverter is None else convert_power(power, self.system.inverter)
