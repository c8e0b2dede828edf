"""Who is let into a Dask cluster on tls://, and whether the address of its page is one."""

import re
import subprocess
from pathlib import Path

import pytest

from citypv.core.cluster import run_tasks
from citypv.core.settings.errors import InputError

distributed = pytest.importorskip("distributed")
yaml = pytest.importorskip("yaml")


def refuse(address, problem):
    with pytest.raises(InputError, match=problem), run_tasks.open_workers(address):
        pass


def test_only_those_with_the_key_are_let_in(tmp_path, monkeypatch):
    """The certificate and the settings are made as docs/guide/many_machines.md says."""
    monkeypatch.setattr(run_tasks, "PATIENCE", 2)
    from dask import config

    text = (Path(__file__).parents[2] / "docs" / "guide" / "many_machines.md").read_text(encoding="utf-8")
    command, settings = re.search("    (openssl req .*)", text)[1], re.search("```yaml\n(.*?)```", text, re.DOTALL)[1]

    def settings_of(name):
        (tmp_path / name).mkdir()
        subprocess.run(command.split(), cwd=tmp_path / name, check=True, capture_output=True)
        own = yaml.safe_load(re.sub(r"(cert|key)\.pem", rf"{tmp_path / name}/\1.pem", settings))
        return config.set(config.merge(config.config, own))

    with settings_of("own"):
        local = {"processes": False, "dashboard_address": None, "host": "tls://127.0.0.1"}
        with distributed.LocalCluster(1, security=distributed.Security(), **local) as cluster:
            address = cluster.scheduler_address
            with run_tasks.open_workers(address) as workers:
                assert list(run_tasks.run_tasks(workers, pow, [(2, 5)])) == [32]
            with settings_of("foreign"):
                refuse(
                    address,
                    "does not accept this machine's key, or finds none; see docs/guide/many_machines.md",
                )
            refuse(address.replace("tls:", "tcp:"), "does not answer")
            with config.set({"distributed.comm.tls.client.cert": None}):
                refuse(address, "does not accept this machine's key")
            with pytest.raises(ValueError, match="No client"):  # else xarray asks its scheduler before it writes
                distributed.default_client()
