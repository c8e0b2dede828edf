"""What is said of schedulers that do not answer, of programs that are none, and of errors that workers send back."""

import pickle
import socket
import socketserver
import threading
from contextlib import suppress

import pytest
from lxml import etree

from citypv.__main__ import main
from citypv.core.cluster import run_tasks
from citypv.core.settings.errors import InputError


@pytest.mark.parametrize("command", [["simulate", "never_read.gml"], ["world", "unshaded"]])
def test_a_cluster_that_does_not_answer_is_named_before_anything_is_read(tmp_path, capfd, command):
    assert run_tasks.PATIENCE == 10
    with socket.socket() as free:  # a port at which nobody listens
        free.bind(("127.0.0.1", 0))
        word = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        assert main([*command, "--cluster", word, "--out", str(tmp_path / "out")]) == 2
    said = capfd.readouterr().err
    assert f"--cluster {word}: does not answer within 10 s; start `dask scheduler` there" in said
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("speech", "problem"),
    [(b"", "does not answer"), (b"SSH-2.0-x\r\n", "is no Dask scheduler"), (b"220", "does not answer")],
)
def test_a_port_where_no_scheduler_listens_is_named(tmp_path, capfd, monkeypatch, speech, problem):
    """One that accepts and stays silent, one that speaks another protocol, and one that stops within its greeting."""
    monkeypatch.setattr(run_tasks, "PATIENCE", 0.5)

    class Speak(socketserver.BaseRequestHandler):
        def handle(self):
            self.request.sendall(speech)
            with suppress(ConnectionError):  # the caller hangs up
                self.request.recv(1 << 16)

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Speak) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        word = f"tcp://127.0.0.1:{server.server_address[1]}"
        assert main(["world", "unshaded", "--cluster", word, "--out", str(tmp_path / "out")]) == 2
        server.shutdown()
    said = capfd.readouterr().err
    assert problem in said
    assert said.count("\n") == 1


def read_broken():
    try:
        etree.fromstring("<a")
    except etree.XMLSyntaxError as error:
        raise InputError("city.gml", "is cut off", "copy it again") from error


def test_an_error_of_a_task_can_be_sent():
    """Dask pickles causes along with an error; those of lxml cannot be pickled."""
    support = pytest.importorskip("tblib.pickling_support")
    with pytest.raises(InputError) as caught:
        run_tasks.run_plainly(read_broken)
    support.install(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == "city.gml: is cut off; copy it again"
