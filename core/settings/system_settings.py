"""Settings of the modules, of the area that counts, and of the tables; part of `core.settings.request.Request`."""

from dataclasses import dataclass

from .setting import setting

CLEARANCES = 0.01, 0.3  # [m] of the paper, where only what touches has no room, and of the default
BUILDINGS = "buildings"  # in place of a surface's id
METHODS = {"paper": "As in Bredemeier et al., CityPV (docs/reference/method_paper.md)"}
MOUNTINGS = {
    "open-rack": "Air all around, glass/polymer (as in the paper)",
    "insulated-back": "On the wall or roof without a gap, glass/polymer",
    "close-mount": "Near the wall or roof, a little air behind, glass/glass",
    "auto": "Near walls and pitched roofs; on open racks on level roofs",  # last: files of Blender count choices
}
INCIDENCE_LAWS = {
    "module": "Sandia's polynomial of the module; Fresnel's equations for modules of the CEC",
    "physical": "Fresnel's equations for a pane",
    "ashrae": "ASHRAE's law",
}
HIDDEN_WALLS = {
    "leave-out": "Area covered by neighbours carries no modules",
    "count": "Covered area counts like open area (as in the paper)",
}
SECTORS = {
    "8": "Facades and roofs of any azimuth, in eight sectors of 45°",
    "paper": "Facades and roofs of 15° to 60° within 30° of north, east, south or west (as in the paper)",
}
OVERHANGS = {
    "leave-out": "Facades lean by 1° at most",
    "count": "Walls that lean outward are facades (as in the paper)",
}


@dataclass
class SystemSettings:
    """Settings about electricity."""

    method: str | None = setting(
        None,
        "electricity",
        "all settings as in the paper (docs/reference/method_paper.md); other options take precedence",
        choices=METHODS,
    )
    module: str = setting(
        "SunPower_SPR_300_WHT__2007__E__",
        "electricity",
        "module: its name, or a part of it, in pvlib's Sandia or CEC library",
        title="Module",
        panel="energy",
        metavar="NAME",
    )
    mounting: str = setting(
        "auto",
        "electricity",
        "mounting of the modules, which determines the cell temperature",
        title="Mounting",
        panel="energy",
        choices=MOUNTINGS,
    )
    iam: str = setting("module", "electricity", "incidence angle modifier of direct light", choices=INCIDENCE_LAWS)
    diffuse_iam: bool = setting(False, "electricity", "incidence angle modifier of diffuse light, too", kind="switch")
    losses: float = setting(
        11.4,  # pvlib.pvsystem.pvwatts_losses(shading=0): shading is traced
        "electricity",
        "DC energy lost to soiling, mismatch, wiring, first sunlight, tolerances and outages",
        title="Losses",
        panel="energy",
        unit="%",
        subtype="PERCENTAGE",
        metavar="P",
        least=0,
        most=99,
    )
    inverter: str | None = setting(
        "pvwatts",
        "electricity",
        "pvwatts, an inverter of pvlib's library, or none",
        title="Inverter",
        panel="energy",
        metavar="NAME",
        none="none",
    )
    dc_ac_ratio: float = setting(
        1.0, "electricity", "nominal power of modules over that of the inverter", metavar="R", above=0, most=10
    )
    hidden_walls: str = setting(
        "leave-out",
        "electricity",
        "whether wall area that a neighbour covers counts",
        title="Hidden walls",
        panel="energy",
        choices=HIDDEN_WALLS,
    )
    clearance: float = setting(
        CLEARANCES[1],
        "electricity",
        "room that a module needs before it, up to a face turned against it",
        title="Clearance",
        panel="energy",
        unit="m",
        metavar="M",
        least=0,
    )
    sectors: str = setting(
        "8",
        "surfaces",
        "azimuths that count: all, in eight sectors, or those of the paper",
        title="Sectors",
        panel="classify",
        choices=SECTORS,
    )
    overhangs: str = setting(
        "leave-out", "electricity", "whether walls that lean outward are facades", choices=OVERHANGS
    )
    usable: dict = setting(
        {},
        "electricity",
        "share of the area that windows and edges leave for modules, by kind",
        kind="shares",
        metavar="KIND=SHARE",
    )
    series: tuple = setting(
        (),
        "electricity",
        f"ids of surfaces whose hourly series are written to series.csv; {BUILDINGS}: power of each in timeseries.nc",
        kind="names",
        metavar="ID",
    )
    monthly: bool = setting(
        False, "electricity", "add monthly full load hours to faces.csv and buildings.csv", kind="flag"
    )
