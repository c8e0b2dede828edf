"""Settings of the modules, of the area that counts, and of the tables; part of `core.request.Request`."""

from dataclasses import dataclass

from .settings import setting

METHODS = {"paper": "As in Bredemeier et al., CityPV (docs/method_paper.md)"}
MOUNTINGS = {
    "open-rack": "Air all around, glass/polymer (the paper's)",
    "insulated-back": "On the wall or roof without a gap, glass/polymer",
    "close-mount": "Near the roof, a little air behind, glass/glass",
}
INCIDENCE_LAWS = {
    "module": "Sandia's polynomial of the module; Fresnel's equations for modules of the CEC",
    "physical": "Fresnel's equations for a pane",
    "ashrae": "ASHRAE's law",
}
HIDDEN_WALLS = {
    "leave-out": "Area covered by neighbours carries no modules",
    "count": "Covered area counts like open area (the paper's)",
}
OVERHANGS = {"leave-out": "Facades lean by 1° at most", "count": "Walls that lean outward are facades (the paper's)"}


@dataclass
class SystemSettings:
    """Settings about electricity."""

    method: str | None = setting(
        None,
        "electricity",
        "all settings as a paper has them; options given beside it win",
        kind="choice",
        choices=METHODS,
    )
    module: str = setting(
        "SunPower_SPR_300_WHT__2007__E__",
        "electricity",
        "name, or part of it, in pvlib's Sandia or CEC library",
        title="Module",
        panel="energy",
        metavar="NAME",
    )
    mounting: str = setting(
        "open-rack",
        "electricity",
        "how the modules are mounted, which decides how warm they get",
        kind="choice",
        title="Mounting",
        panel="energy",
        choices=MOUNTINGS,
    )
    iam: str = setting(
        "module", "electricity", "loss of direct light by its angle of incidence", kind="choice", choices=INCIDENCE_LAWS
    )
    diffuse_iam: bool = setting(
        False, "electricity", "whether diffuse light loses by its angles of incidence, too", kind="switch"
    )
    losses: float = setting(
        0.0,
        "electricity",
        "share of DC energy that is lost to soiling, mismatch, wiring",
        kind="number",
        title="DC losses",
        panel="energy",
        unit="%",
        subtype="PERCENTAGE",
        metavar="P",
        least=0,
        most=99,
    )
    inverter: str | None = setting(
        None, "electricity", "pvwatts, or a name of pvlib's library; default: none", metavar="NAME", none="none"
    )
    dc_ac_ratio: float = setting(
        1.0, "electricity", "nominal power of modules over inverter's", kind="number", metavar="R", above=0, most=10
    )
    hidden_walls: str = setting(
        "leave-out",
        "electricity",
        "whether area counts that neighbours cover",
        kind="choice",
        title="Hidden walls",
        panel="energy",
        choices=HIDDEN_WALLS,
    )
    overhangs: str = setting(
        "leave-out", "electricity", "walls that lean outward by more than 1°", kind="choice", choices=OVERHANGS
    )
    usable: dict = setting(
        {},
        "electricity",
        "share of the area that windows and edges leave, by kind",
        kind="shares",
        metavar="KIND=SHARE",
    )
    series: tuple = setting(
        (), "electricity", "ids of surfaces whose hourly series are written", kind="names", metavar="ID"
    )
    monthly: bool = setting(False, "electricity", "columns of the months in faces.csv and buildings.csv", kind="flag")
