"""Modules, mountings, losses and inverters against pvlib called directly."""

from types import SimpleNamespace

import numpy as np
import pvlib
import pytest
from planes import SANDIA, cell_temperature, light_on_plane, sapm_power, spectral_by_pvlib
from thorough import mark_cases
from transfers import Horizons, unshaded_transfer

from citypv.core.energy import compute_energy as module_under_test
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.power import dc_factor, dc_power, spectral_factor, tabulate_power
from citypv.core.energy.pv_system import build_system, dc_system, pick_inverter, pick_module
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

CEC = "Canadian_Solar_Inc__CS5P_220M"
INVERTER = "ABB__MICRO_0_25_I_OUTD_US_208__208V_"
PARAMETERS = {
    "open-rack": "open_rack_glass_polymer",
    "insulated-back": "insulated_back_glass_polymer",
    "close-mount": "close_mount_glass_glass",
}
NO_LOSSES = {"losses": 0.0, "inverter": None}
TILT, AZIMUTH = [90, 90, 37.3, 0, 90, 55], [180, 90, 200, 0, 0, 280]


@pytest.fixture(scope="module")
def hourly(berlin):
    return choose_suns(
        "hourly", berlin.data.index, berlin.interval, berlin.latitude, berlin.longitude
    )


def cec_power(effective, temp_cell):
    """Capacity factor by pvlib's single-diode model, solved the slow way."""
    module = pvlib.pvsystem.retrieve_sam("CECMod")[CEC]
    names = ("alpha_sc", "a_ref", "I_L_ref", "I_o_ref", "R_sh_ref", "R_s", "Adjust")
    lit = (effective > 0).to_numpy()
    diode = pvlib.pvsystem.calcparams_cec(
        effective[lit], temp_cell[lit], **{name: module[name] for name in names}
    )
    power = np.zeros(len(effective))
    power[lit] = pvlib.pvsystem.singlediode(*diode, method="lambertw")["p_mp"]
    return power / (module["I_mp_ref"] * module["V_mp_ref"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mounting", "iam"),
    mark_cases(list(zip(PARAMETERS, ("module", "ashrae", "module"), strict=True)), kept=1),
)
def test_cec_modules_hour_by_hour(berlin, hourly, mounting, iam):
    system = build_system(Request(module=CEC, mounting=mounting, iam=iam, **NO_LOSSES))
    rows = np.arange(len(TILT))
    series = compute_energy(
        unshaded_transfer(hourly, TILT, AZIMUTH), berlin, system, series=rows
    ).series
    law = {"module": pvlib.iam.physical, "ashrae": pvlib.iam.ashrae}[iam]
    for row, (tilt, azimuth) in enumerate(zip(TILT, AZIMUTH, strict=True)):
        direct, sky, ground, aoi = light_on_plane(berlin.data, tilt, azimuth)
        temp_cell = cell_temperature(berlin.data, direct + sky + ground, PARAMETERS[mounting])
        expected = cec_power(direct * law(aoi) + sky + ground, temp_cell)
        np.testing.assert_allclose(series.poa_direct[:, row], direct, atol=1e-3)
        np.testing.assert_allclose(series.poa_diffuse[:, row], sky + ground, atol=1e-3)
        np.testing.assert_allclose(series.capacity_factor[:, row], expected, atol=2e-7)


@pytest.mark.slow
@pytest.mark.parametrize("iam", ["module", "physical"])
def test_diffuse_light_loses_by_marions_integral(berlin, hourly, iam):
    system = build_system(
        Request(mounting="insulated-back", iam=iam, diffuse_iam=True, **NO_LOSSES)
    )
    transfer = unshaded_transfer(hourly, TILT, AZIMUTH)
    energy = compute_energy(transfer, berlin, system)
    without = compute_energy(transfer, berlin, build_system(Request(iam=iam, **NO_LOSSES)))
    module = pvlib.pvsystem.retrieve_sam("SandiaMod")[SANDIA]
    model, own = ("sapm", {"module": module}) if iam == "module" else ("physical", {})
    for row, (tilt, azimuth) in enumerate(zip(TILT, AZIMUTH, strict=True)):
        direct, sky, ground, aoi = light_on_plane(berlin.data, tilt, azimuth)
        kept = pvlib.iam.marion_diffuse(model, tilt, **own)
        law = pvlib.iam.sapm(aoi, module) if iam == "module" else pvlib.iam.physical(aoi)
        effective = spectral_by_pvlib(berlin.data) * (
            direct * law + sky * kept["sky"] + ground * kept["ground"]
        )
        temp_cell = cell_temperature(
            berlin.data, direct + sky + ground, PARAMETERS["insulated-back"]
        )
        assert energy.full_load_hours[row] == pytest.approx(
            sapm_power(effective, temp_cell).sum(), rel=5e-5
        )
    assert (energy.full_load_hours < without.full_load_hours * 0.985).all()


SYSTEMS = [
    {},
    {"module": "First_Solar__Inc__FS_385"},
    {"mounting": "close-mount", "diffuse_iam": True, **NO_LOSSES},
    {"losses": 14.0, "inverter": "pvwatts", "dc_ac_ratio": 1.3},
    {"module": CEC, "inverter": INVERTER, "iam": "ashrae"},
]


@pytest.mark.slow
@pytest.mark.parametrize(
    "given",
    mark_cases(SYSTEMS, kept=2, law=(3,)),
    ids=lambda given: " ".join(map(str, given.values())) or "default",
)
def test_tables_equal_pvlib_hour_by_hour(berlin, hourly, given, monkeypatch):
    """Within 0.05 % or 1e-5 of nominal power."""
    transfer = Horizons(25, 3).transfer(hourly)
    found = []
    for limit in (1e12, 0):
        monkeypatch.setattr(module_under_test, "PLAIN_LIMIT", limit)
        found.append(
            compute_energy(transfer, berlin, build_system(Request(**given)), series=np.arange(25))
        )
    plain, fast = found
    exact = plain.series.capacity_factor
    np.testing.assert_array_less(
        np.abs(fast.series.capacity_factor - exact), np.maximum(1e-5, 5e-4 * np.abs(exact))
    )
    for name in ("full_load_hours", "full_load_hours_dc"):
        np.testing.assert_allclose(getattr(fast, name), getattr(plain, name), rtol=2e-5)


@pytest.mark.slow
def test_losses_and_inverters(berlin, hourly):
    transfer = unshaded_transfer(hourly, TILT, AZIMUTH)
    rows, rack = np.arange(len(TILT)), {"mounting": "open-rack"}
    plain = compute_energy(transfer, berlin, series=rows)
    np.testing.assert_allclose(plain.full_load_hours_dc, plain.full_load_hours, rtol=1e-12)
    lost = compute_energy(
        transfer, berlin, build_system(Request(losses=14.0, inverter=None, **rack))
    )
    np.testing.assert_allclose(lost.full_load_hours_dc, plain.full_load_hours, rtol=1e-12)
    np.testing.assert_allclose(lost.full_load_hours, 0.86 * plain.full_load_hours)
    # PVWatts by hand: 300 W of modules on an inverter of 200 W.
    system = build_system(Request(losses=10.0, dc_ac_ratio=1.5, **rack))
    series = compute_energy(transfer, berlin, system, series=rows).series
    power = plain.series.capacity_factor * 0.9 * 300
    expected = pvlib.inverter.pvwatts(power, pdc0=200 / 0.96, eta_inv_nom=0.96) / 300
    np.testing.assert_allclose(series.capacity_factor, expected, atol=1e-12)
    assert series.capacity_factor.max() == pytest.approx(
        1 / 1.5
    )  # what the inverter cannot take is lost
    # One of the library at its nominal voltage, as many modules as its largest power asks for.
    library = pvlib.pvsystem.retrieve_sam("CECInverter")[INVERTER]
    energy = compute_energy(
        transfer, berlin, build_system(Request(losses=0.0, inverter=INVERTER, **rack)), series=rows
    )
    power = plain.series.capacity_factor * library["Paco"]
    expected = (
        np.maximum(pvlib.inverter.sandia(library["Vdco"], power, library), 0) / library["Paco"]
    )
    np.testing.assert_allclose(energy.series.capacity_factor, expected, atol=1e-12)
    np.testing.assert_allclose(energy.full_load_hours, expected.sum(axis=0), rtol=1e-9)
    assert (energy.full_load_hours < 0.97 * energy.full_load_hours_dc).all()


@pytest.mark.slow
def test_the_defaults_are_pvwatts_plant(berlin, hourly):
    """ModelChain with losses and inverter of PVWatts; modules near walls and pitched roofs, on
    racks on level ones.
    """
    energy = compute_energy(
        unshaded_transfer(hourly, TILT, AZIMUTH), berlin, build_system(Request())
    )
    module = pvlib.pvsystem.retrieve_sam("SandiaMod")[SANDIA]
    nominal = module["Impo"] * module["Vmpo"]
    for row, (tilt, azimuth) in enumerate(zip(TILT, AZIMUTH, strict=True)):
        direct, sky, ground, aoi = light_on_plane(berlin.data, tilt, azimuth)
        effective = spectral_by_pvlib(berlin.data) * (
            direct * pvlib.iam.sapm(aoi, module) + sky + ground
        )
        mount = pvlib.pvsystem.FixedMount(tilt, azimuth)
        mounting = PARAMETERS["open-rack" if tilt == 0 else "close-mount"]
        warmth = pvlib.temperature.TEMPERATURE_MODEL_PARAMETERS["sapm"][mounting]
        array = pvlib.pvsystem.Array(
            mount, module_parameters=module, temperature_model_parameters=warmth
        )
        inverter, losses = {"pdc0": nominal / 0.96}, {"shading": 0}
        plant = pvlib.pvsystem.PVSystem(
            [array], inverter_parameters=inverter, losses_parameters=losses
        )
        models = {
            "ac_model": "pvwatts",
            "losses_model": "pvwatts",
            "temperature_model": "sapm",
            "dc_model": "sapm",
        }
        place = pvlib.location.Location(berlin.latitude, berlin.longitude)
        chain = pvlib.modelchain.ModelChain(
            plant, place, aoi_model="no_loss", spectral_model="no_loss", **models
        )
        light = {"effective_irradiance": effective, "poa_global": direct + sky + ground}
        chain.run_model_from_effective_irradiance(
            berlin.data[["temp_air", "wind_speed"]].assign(**light)
        )
        # The default of 11.4 % is rounded from 11.42 %.
        assert energy.full_load_hours[row] == pytest.approx(
            chain.results.ac["p_mp"].sum() / nominal, rel=4e-4
        )
    np.testing.assert_allclose(energy.full_load_hours_standard_error, 0)


def test_the_spectral_polynomial_ends_where_its_coefficients_do():
    system = dc_system()
    found = spectral_factor(np.array([1.0, 9.9, 10.0, 20.0, 38.0, np.nan]), system)
    own = pvlib.pvsystem.retrieve_sam("SandiaMod")[SANDIA]
    np.testing.assert_allclose(
        found[:3], pvlib.spectrum.spectral_factor_sapm(np.array([1.0, 9.9, 10.0]), own)
    )
    assert (found[2:5] == found[2]).all() and found[5] == 0
    assert (
        pvlib.spectrum.spectral_factor_sapm(38.0, own) > 10
    )  # where the polynomial itself would lead
    assert (spectral_factor(np.array([1.0, np.nan]), build_system(Request(module=CEC))) == 1).all()


@pytest.mark.slow
def test_module_names():
    module = pick_module(SANDIA)
    assert module.nominal_power == pytest.approx(300.303) and module.library == "SandiaMod"
    assert pick_module("SunPower SPR-300-WHT [2007 (E)]") == module
    assert pick_module("spr-300-wht") == module  # part of one name only
    assert (
        pick_module(CEC).area == pytest.approx(1.701, abs=0.1)
        and pick_module(CEC).library == "CECMod"
    )
    assert pick_module("canadian solar inc. CS5P-220M").name == CEC
    with pytest.raises(InputError, match=rf"--module.*nearest: .*{SANDIA}"):
        pick_module("SunPower_SPR_300_WHT__2007__F__")
    words = r"--module.*matches 2 names.*Canadian_Solar_CS5P_220M___2009_, .*_Inc__CS5P_220M"
    with pytest.raises(InputError, match=words):
        pick_module("CS5P 220M")
    for empty in ("", "!?"):
        with pytest.raises(InputError, match=r"--module.*nearest"):
            pick_module(empty)


@pytest.mark.slow
@pytest.mark.parametrize("library", ["SandiaMod", "CECMod"])
def test_modules_of_the_libraries_work(library):
    """At reference conditions each gives its nominal power."""
    names = np.random.default_rng(0).choice(
        pvlib.pvsystem.retrieve_sam(library).columns, 30, replace=False
    )
    for name in names:
        module = pick_module(name)
        assert module.name == name and module.area > 0
        power = dc_power(np.array([1000.0, 1.0]), np.array([25.0, -30.0]), module)
        assert power[0] == pytest.approx(1, abs=0.01) and 0 <= power[1] < 0.002, name


def test_inverter_names():
    assert pick_inverter("PVWatts", 1.2).dc_ac_ratio == 1.2
    assert pick_inverter("abb micro 0.25 i outd us 208 [208v]").name == INVERTER
    with pytest.raises(InputError, match=r"--inverter.*nearest"):
        pick_inverter("no such inverter at all")


def test_shares_that_overshoot_below_zero_give_no_power():
    """Cubics between traced days may leave a surface slightly less than no direct light."""
    zero, one = np.zeros((1, 1), np.float32), np.ones((1, 1), np.float32)
    hours = SimpleNamespace(heating=zero, temp_air=25 * one, wind_speed=one, spectral_factor=one)
    direct, diffuse = np.array([[-5.0, -5.0]], np.float32), np.array([[1.0, 50.0]], np.float32)
    curves = tabulate_power(build_system(Request()))
    light = direct, diffuse, diffuse.copy(), np.full_like(direct, 0.7)
    found = dc_factor(curves, *light, hours=hours, mounting=np.zeros(2, int))
    assert found[0, 0] == 0
    assert 0.1 < found[0, 1] / (45 / 1000) < 1.1
