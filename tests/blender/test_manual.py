"""*Online Manual* leads from every button and setting to a page that is there."""

import re
from pathlib import Path

import bpy

import citypv
from citypv.citypv_addon import manual
from citypv.core.commands.command_line import COMMANDS

DOCS = Path(citypv.__file__).parent / "docs"


def anchors_of(page):
    headings = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.M)
    return {re.sub(r"[^\w -]", "", words).strip().lower().replace(" ", "-") for words in headings}


def test_every_page_and_section_is_there():
    for _, address in manual.PAGES:
        name, _, anchor = address.partition("#")
        if name.startswith("options/"):
            assert Path(name).stem in COMMANDS
            continue
        page = (DOCS / name).with_suffix(".md")
        assert page.exists(), name
        assert not anchor or anchor in anchors_of(page), address


def test_every_button_and_setting_has_a_page(addon, tmp_path, monkeypatch):
    (tmp_path / "manual").mkdir()
    (tmp_path / "manual/index.html").touch()
    monkeypatch.setattr(manual, "ROOT", tmp_path)
    look_up = bpy.types.WM_OT_doc_view_manual._lookup_rna_url
    names = [f"bpy.ops.citypv.{name}" for name in dir(bpy.ops.citypv)]
    names += [
        f"bpy.types.{type(bpy.context.scene.citypv).__name__}.{name}"
        for name in bpy.context.scene.citypv.bl_rna.properties.keys()  # noqa: SIM118
        if name not in ("rna_type", "name")
    ]
    assert len(names) > 80
    pages = {address for _, address in manual.PAGES}
    for name in names:
        address = look_up(name, verbose=False)
        assert address and address.removeprefix(f"{(tmp_path / 'manual').as_uri()}/") in pages, name
    assert look_up("bpy.ops.citypv.energy", verbose=False).endswith("guide/your_plant.html")


def test_without_the_manual_blender_says_so(addon, tmp_path, monkeypatch):
    monkeypatch.setattr(manual, "ROOT", tmp_path)
    assert manual.find_manual() is None
    assert (
        bpy.types.WM_OT_doc_view_manual._lookup_rna_url("bpy.ops.citypv.energy", verbose=False)
        is None
    )
