"""What the package says of itself: stubs, README of an index, citation, workflows."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from load_tool import load_tool

import citypv

ROOT = Path(citypv.__file__).parent


@pytest.mark.slow
def test_the_stub_is_what_make_stubs_writes():
    done = subprocess.run([sys.executable, ROOT / "tools/make_stubs.py", "--check"], check=False)
    assert done.returncode == 0, "type: make stubs"


def test_help_of_python_lists_settings_with_type_unit_and_default():
    words = citypv.simulate.__doc__
    assert "target_error : float, optional\n    [%] trace rounds until" in words
    assert "sky : {'auto', 'perez', 'isotropic'}, default 'auto'\n    model" in words
    assert "\nsamples :" not in citypv.inspect.__doc__


@pytest.mark.parametrize(
    ("text", "address", "detached"),
    [
        ("![roof](docs/a.png) see [cost](docs/b.md#c)", None, " see cost"),
        ("![roof](docs/a.png)", "https://host/x/", "![roof](https://host/x/docs/a.png)"),
        ("[out](https://host/y) [here](#use)", None, "[out](https://host/y) [here](#use)"),
    ],
)
def test_links_of_the_readme_do_without_the_files_beside_it(text, address, detached):
    assert load_tool("build_package").detach_links(text, address) == detached


def test_citation_and_package_agree():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    assert re.search(r"^version: (.+)$", citation, re.M)[1] == project["version"]
    assert re.search(r"^license: (.+)$", citation, re.M)[1] == project["license"]
    assert project["authors"][0]["name"] in citation
    assert f"## {project['version']}\n" in (ROOT / "CHANGELOG.md").read_text("utf-8")


@pytest.mark.parametrize("name", [".github/workflows/check.yml", ".gitlab-ci.yml"])
def test_workflows_call_targets_that_exist(name):
    text = (ROOT / name).read_text("utf-8")
    targets = set(re.findall(r"- (?:run: )?make ([a-z]+)", text))
    known = set(re.findall(r"^([a-z -]+):", (ROOT / "Makefile").read_text("utf-8"), re.M))
    assert {"check", "oldest", "package", "extension"} <= targets
    assert targets <= {word for line in known for word in line.split()}


@pytest.mark.skipif(sys.platform != "linux", reason="names this system")
def test_installing_on_arm_says_what_is_missing():
    code = (
        "import platform, runpy; platform.machine = lambda: 'aarch64'; runpy.run_path('setup.py')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr.startswith("CityPV needs embreex, which has no wheel for Linux on aarch64")
    assert len(done.stderr.splitlines()) == 1
