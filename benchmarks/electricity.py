"""Electricity of 100,000 surfaces in five years of every hour, and 200 of them against pvlib hour
by hour.

    python benchmarks/electricity.py [--surfaces 100000] [--years 5] [--suns typical-days:12]
    [--module NAME]

The Transfer is synthetic: random walls and roofs under random skylines. Its weather is a clear sky
whose hours are dimmed at random, with its temperatures. pvlib is called directly here, with the
irradiance on each surface put in.
"""

import argparse
import sys
import time
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib

from citypv.core.settings.request import Request

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "core"))
from transfers import Horizons, unshaded_transfer

from citypv.core.energy import compute_energy as module_of_energy
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import MOUNTINGS, build_system
from citypv.core.light.sun_matrix import keep_matrix
from citypv.core.results.write_summary import peak_memory
from citypv.core.run.make_world import modules_alone
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.read_weather import read_weather

LATITUDE, LONGITUDE, ALTITUDE = 52.5, 13.4, 40.0
CHECKED = 200
BLOCK = 2000


def cloudy_years(first, count):
    """Hourly weather of some years: the clear sky, dimmed hour by hour, with a year's and a day's
    cycle of warmth.
    """
    rng = np.random.default_rng(1)
    years = range(first, first + count)
    parts = [read_weather("clear-sky", LATITUDE, LONGITUDE, ALTITUDE, year=year) for year in years]
    data = pd.concat([part.data for part in parts])
    share = rng.beta(1.2, 1.0, len(data))
    direct = (data["ghi"] - data["dhi"]).to_numpy()
    data["dni"] *= share
    data["dhi"] += 0.4 * (1 - share) * direct
    data["ghi"] = data["dhi"] + share * direct
    day, hour = data.index.day_of_year.to_numpy(), data.index.hour.to_numpy()
    data["temp_air"] = (
        10 - 10 * np.cos(2 * np.pi * (day - 15) / 365) - 4 * np.cos(2 * np.pi * (hour - 3) / 24)
    )
    data["wind_speed"] = rng.weibull(2, len(data)) * 4
    return replace(parts[0], data=data, label="dimmed clear sky")


def make_transfer(count, suns):
    """Random walls and roofs under random skylines; what does not fit into the memory lies
    on disk.
    """
    horizons = Horizons(count, 0)
    transfer = unshaded_transfer(replace_suns(suns, 0), horizons.tilt, horizons.azimuth)
    visible, reflected = keep_matrix((count, len(suns))), keep_matrix((count, len(suns)))
    step = max(1, BLOCK * 100 // count)
    for first in range(0, len(suns), step):
        chosen = slice(first, min(first + step, len(suns)))
        facing = transfer.surfaces.normal @ suns.direction[chosen].T > 0
        visible[:, chosen] = (facing * horizons.visible(suns.direction[chosen])).astype(np.float32)
        reflected[:, chosen] = np.broadcast_to(horizons.reflected, facing.shape).astype(np.float32)
    transfer.diffuse_relative *= 0.7
    return replace(transfer, suns=suns, visible_share=visible, direct_reflected=reflected)


def replace_suns(suns, count):
    """The first suns only."""
    return replace(
        suns,
        **{
            one.name: getattr(suns, one.name)[:count]
            for one in fields(suns)
            if one.name != "sampling"
        },
    )


def pvlib_power(weather, transfer, row, series, system):
    """Capacity factor of one surface from the irradiance on it, straight from pvlib."""
    data, module = weather.data, system.module.parameters
    sun = data["apparent_zenith"], data["solar_azimuth"]
    surfaces = transfer.surfaces
    aoi = pvlib.irradiance.aoi(surfaces.surface_tilt[row], surfaces.surface_azimuth[row], *sun)
    direct, diffuse = series
    thermal = MOUNTINGS[system.mounting]
    temp_cell = pvlib.temperature.sapm_cell(
        direct + diffuse, data["temp_air"], data["wind_speed"], **thermal
    )
    lit = (direct + diffuse > 0).to_numpy()
    power = np.zeros(len(data))
    if system.module.library == "SandiaMod":
        airmass = pvlib.atmosphere.get_absolute_airmass(
            pvlib.atmosphere.get_relative_airmass(sun[0]), data["pressure"]
        )
        effective = pvlib.pvsystem.sapm_effective_irradiance(
            direct, diffuse, np.minimum(airmass, 10), aoi, module
        )
        power[lit] = pvlib.pvsystem.sapm(effective[lit], temp_cell[lit], module)["p_mp"].fillna(0)
    else:
        names = ("alpha_sc", "a_ref", "I_L_ref", "I_o_ref", "R_sh_ref", "R_s", "Adjust")
        effective = (direct * pvlib.iam.physical(aoi) + diffuse)[lit]
        diode = pvlib.pvsystem.calcparams_cec(
            effective, temp_cell[lit], **{name: module[name] for name in names}
        )
        power[lit] = pvlib.pvsystem.singlediode(*diode, method="lambertw")["p_mp"]
    return power / system.module.nominal_power


def check_against_pvlib(transfer, weather, system, found):
    """Largest difference of capacity factors, of its allowance: 0.05 % or 1e-5 of nominal power."""
    rows, worst, hours = found.series.rows, 0.0, np.zeros(CHECKED)
    index = weather.data.index
    for place, row in enumerate(rows):
        # What the program says of the light is given; the rest is pvlib's.
        series = [
            pd.Series(values[:, place], index)
            for values in (found.series.poa_direct, found.series.poa_diffuse)
        ]
        exact = pvlib_power(weather, transfer, row, series, system)
        allowed = np.maximum(1e-5, 5e-4 * exact)
        worst = max(
            worst, float((np.abs(found.series.capacity_factor[:, place] - exact) / allowed).max())
        )
        hours[place] = exact.sum() / found.years
    return worst, float(np.abs(found.full_load_hours[rows] / hours - 1).max())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--surfaces", type=int, default=100_000)
    parser.add_argument("--years", type=int, default=5)
    parser.add_argument("--suns", default="typical-days:12")
    parser.add_argument("--module", default=Request.module)
    parser.add_argument("--threads", type=int)
    options = parser.parse_args()
    weather = cloudy_years(2015, options.years)
    one = weather.data.index[:8760], weather.interval, LATITUDE, LONGITUDE
    suns = choose_suns(options.suns, *one)
    transfer = make_transfer(options.surfaces, suns)
    system = build_system(modules_alone(Request(module=options.module)))
    rows = np.sort(np.random.default_rng(2).choice(options.surfaces, CHECKED, replace=False))
    before = peak_memory() / 1e9
    started, busy = time.perf_counter(), time.process_time()
    compute_energy(transfer, weather, system, options.threads)
    seconds, busy = time.perf_counter() - started, time.process_time() - busy
    lit = int(((weather.data["ghi"] > 0) | (weather.data["dni"] > 0)).sum())
    work = options.surfaces * lit
    print(
        f"{options.surfaces:,} surfaces x {lit:,} hours with light of {options.years} years, "
        f"{len(suns):,} suns"
    )
    print(
        f"{seconds:.1f} s, {busy:.1f} s of processors, {work / seconds / 1e6:.0f} million "
        "surface-hours per second"
    )
    print(f"peak memory {peak_memory() / 1e9:.2f} GB ({before:.2f} GB before)")
    module_of_energy.PLAIN_LIMIT = 0  # tables for the few surfaces that are checked, too
    few = transfer.take(rows)
    found = compute_energy(few, weather, system, options.threads, series=np.arange(CHECKED))
    worst, annual = check_against_pvlib(few, weather, system, found)
    print(
        f"{CHECKED} surfaces against pvlib: hour by hour {worst:.2f} of what is allowed, full load "
        f"hours {annual:.1e}"
    )


if __name__ == "__main__":
    main()
