"""The daemon on a network, by real TLS: nothing without a token, pairing, revocation that ends streams, and no secrets.

It is asked at this machine's own address; the own screen at loopback.
"""

from __future__ import annotations

import contextlib
import hashlib
import http.client
import os
import socket
import ssl
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from daemon_process import ROOT, WAIT_S, Daemon, wait_for
from networked_daemon import NetworkedDaemon, own_address

from device.access.certificate import ServerCertificate, own_certificate
from device.files.plain_settings import DaemonAddress
from device.update.gate import ask_parts

pytestmark = pytest.mark.real_time
LOOPBACK = "0100007F"
"""127.0.0.1 in the kernel's tables."""
SHELL = {**os.environ, "PYTHONPATH": str(ROOT)}


@pytest.fixture(scope="module")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Iterator[NetworkedDaemon]:
    running = NetworkedDaemon(tmp_path_factory.mktemp("network"))
    yield running
    running.daemon.stop()


def bearer(token):
    return {"authorization": f"Bearer {token['token']}"}


def test_another_machine_is_answered_by_tls_and_with_a_token_alone(probe):
    assert probe.ask("GET", "/api/v1/health/live").json() == {"status": "live"}
    refused = probe.ask("GET", "/api/v1/measurements")
    assert (refused.status_code, refused.json()["code"]) == (401, "E820")
    token = probe.token("read")
    assert probe.ask("GET", "/api/v1/measurements", **bearer(token)).status_code == 200
    assert probe.ask("POST", "/api/v1/presses", {}, **bearer(token)).json()["code"] == "E821"
    clear = httpx.get(f"http://{probe.address}:{probe.port}/api/v1/measurements", headers=bearer(token))
    assert (clear.status_code, clear.json()["code"]) == (403, "E824")


def test_a_machine_that_may_measure_presses_and_the_audit_says_which_it_was(probe):
    token = probe.token("measure")
    started = probe.ask("POST", "/api/v1/presses", {"mode": "quick"}, **bearer(token))
    assert started.status_code == 202
    press = probe.daemon.ended(started.headers["location"])
    assert press["state"] == "done"
    told = probe.daemon.ask(f"/api/v1/audit?subject={press['id']}").json["entries"]
    assert [(one["what"], one["client"]) for one in told] == [("press_ended", "probe"), ("press_begun", "measure PC")]
    wait_for(probe.daemon.log_text, lambda log: f"press id={press['id']} state=done mode=quick" in log)


def test_the_own_screen_is_asked_for_nothing_and_says_how_others_reach_it(probe):
    network = probe.daemon.ask("/api/v1/device").json["network"]
    shown = ssl.get_server_certificate((probe.address, probe.tls_port))
    assert network["certificate_sha256"].replace(":", "").lower() == sha256(shown)
    assert network["url"].endswith(f":{probe.tls_port}/")


def sha256(pem):
    return hashlib.sha256(ssl.PEM_cert_to_DER_cert(pem)).hexdigest()


def test_a_browser_is_led_from_the_clear_address_to_pairing(probe):
    clear = httpx.get(f"http://{probe.address}:{probe.port}/")
    assert (clear.status_code, clear.headers["location"]) == (307, f"{probe.url}/")
    encrypted = probe.ask("GET", "/")
    assert (encrypted.status_code, encrypted.headers["location"]) == (303, "/pair")
    assert "/static/pair.js" in probe.ask("GET", "/pair").text


@contextlib.contextmanager
def events(probe, token):
    """The stream of events of another machine, begun."""
    line = http.client.HTTPSConnection(probe.address, probe.tls_port, context=probe.trust, timeout=WAIT_S)
    line.request("GET", "/api/v1/events", headers=bearer(token))
    stream = line.getresponse()
    assert stream.status == 200
    yield stream
    line.close()


def test_a_revoked_token_ends_its_streams_and_nobody_elses(probe):
    token, other = probe.token("read"), probe.token("read")
    with events(probe, token) as stream, events(probe, other) as kept:
        assert stream.readline()
        assert kept.readline()
        assert probe.daemon.ask(f"/api/v1/tokens/{token['id']}", "DELETE").status == 200
        while stream.readline():
            pass  # it comes to its end
        for _ in range(6):
            assert kept.readline()
    assert probe.ask("GET", "/api/v1/status", **bearer(token)).json()["code"] == "E820"


def tls(probe, **of_context):
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    for name, value in of_context.items():
        setattr(context, name, value)
    return context


def handshake(probe, context):
    with (
        socket.create_connection((probe.address, probe.tls_port), WAIT_S) as line,
        context.wrap_socket(line) as encrypted,
    ):
        return encrypted.version(), encrypted.cipher()[0]


def test_no_old_tls_and_no_weak_cipher_is_spoken(probe):
    assert handshake(probe, tls(probe))[0] == "TLSv1.3"
    context = tls(probe, maximum_version=ssl.TLSVersion.TLSv1_2)
    version, cipher = handshake(probe, context)
    assert version == "TLSv1.2"
    assert cipher.startswith("ECDHE-ECDSA-")
    for weak in ("AES128-SHA:AES256-SHA256", "ECDHE-ECDSA-AES128-SHA256:ECDHE-ECDSA-AES256-SHA"):
        context = tls(probe, maximum_version=ssl.TLSVersion.TLSv1_2)
        context.set_ciphers(f"{weak}:@SECLEVEL=0")
        with pytest.raises(ssl.SSLError):
            handshake(probe, context)
    old = tls(probe)
    old.set_ciphers("ALL:@SECLEVEL=0")
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        old.minimum_version, old.maximum_version = ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1
    with pytest.raises((ssl.SSLError, OSError)):
        handshake(probe, old)


def test_pair_and_tokens_of_the_command_line_ask_the_daemon(probe):
    def run(*arguments):
        options = ["--simulate", "--config", "probe.toml", "--port", str(probe.port), *arguments]
        command = [sys.executable, "-m", "device", *options]
        return subprocess.run(command, cwd=probe.folder, env=SHELL, capture_output=True, text=True, check=False)

    code = run("pair", "--name", "Shell PC", "--scope", "admin")
    assert code.returncode == 0, code.stderr
    brought = next(word for word in code.stdout.replace(",", " ").split() if len(word) == 9 and word[4] == "-")
    made = probe.ask("POST", "/api/v1/pairing/claim", {"code": brought}).json()
    assert made["name"] == "Shell PC"
    assert made["id"] in run("tokens").stdout
    assert run("tokens", "--revoke", made["id"]).stdout == "The token of Shell PC holds no more.\n"
    assert "no token" in run("tokens", "--revoke", made["id"]).stderr
    assert str(ROOT) not in code.stdout


def listening_to_others(process_id):
    """The ports at which a process and its children listen beside loopback, as the kernel tells."""
    own = {process_id, *map(int, Path(f"/proc/{process_id}/task/{process_id}/children").read_text().split())}
    sockets = set()
    for one in own:
        for link in Path(f"/proc/{one}/fd").iterdir():
            with contextlib.suppress(OSError):
                sockets.add(os.readlink(link))
    ports = set()
    for table in ("tcp", "tcp6", "udp", "udp6"):
        for row in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            _, at, _, state, *_, inode = row.split()[:10]
            address, _, port = at.partition(":")
            if f"socket:[{inode}]" in sockets and (state == "0A" or table.startswith("udp")) and address != LOOPBACK:
                ports.add((table, int(port, 16)))
    return ports


def test_it_listens_at_its_two_ports_and_at_no_other(probe):
    found = listening_to_others(probe.daemon.process.pid)
    assert found == {("tcp", probe.port), ("tcp", probe.tls_port)}


def test_no_secret_is_in_the_log_the_data_folder_or_a_backup(probe):
    token = probe.token("admin")
    probe.ask("GET", "/api/v1/exams?patient_ref=Canary-17&token=planted-secret", **bearer(token))
    probe.ask("GET", f"/api/v1/exams/{token['token']}", **bearer(token))
    probe.ask("GET", "/api/v1/exams", cookie=f"__Host-tsis={token['token']}")
    wait_for(probe.daemon.log_text, lambda log: log.count("route=/api/v1/exams ") >= 2)
    backup = probe.folder / "probe.backup"
    verb = ("backup", "--same-disk", str(backup))
    command = [sys.executable, "-m", "device", "--simulate", "--config", "probe.toml", *verb]
    subprocess.run(command, cwd=probe.folder, env=SHELL, check=True, capture_output=True)
    key = (probe.folder / "var" / "tls" / "key.pem").read_bytes().splitlines()[1]
    kept = [path for path in probe.folder.rglob("*") if path.is_file() and path.name != "key.pem"]
    content = {path.name: path.read_bytes() for path in kept}
    assert {"log.txt", "probe.backup", "tsis.sqlite"} <= set(content)
    for secret in (token["token"].encode(), b"planted-secret", b"Canary-17", key):
        assert [name for name, found in content.items() if secret in found] == []


@pytest.mark.long
def test_a_hospitals_certificate_is_shown_and_a_client_without_one_of_its_authority_is_refused(tmp_path):
    """The authority is a certificate of its own here: a client shows that very one."""
    server = own_certificate(tmp_path / "hospital", ["probe"])
    client = ServerCertificate(tmp_path / "client.pem", tmp_path / "client_key.pem")
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-noenc", "-days", "1", "-subj", "/CN=ward-pc"]
    files = ["-keyout", str(client.key), "-out", str(client.certificate), "-addext", "extendedKeyUsage=clientAuth"]
    subprocess.run([*made, *files], check=True, capture_output=True)
    more = f'certificate = "{server.certificate}"\ncertificate_key = "{server.key}"\n'
    probe = NetworkedDaemon(tmp_path, f'{more}client_authority = "{client.certificate}"\n')
    try:
        assert probe.daemon.ask("/api/v1/device").json["network"]["certificate_sha256"] == server.sha256
        assert not (tmp_path / "var" / "tls").exists()
        context = tls(probe)
        url = f"{probe.url}/api/v1/health/live"
        with pytest.raises((httpx.HTTPError, ssl.SSLError)), httpx.Client(verify=context, timeout=WAIT_S) as other:
            other.get(url)
        context.load_cert_chain(client.certificate, client.key)
        with httpx.Client(verify=context, timeout=WAIT_S) as known:
            assert known.get(url).status_code == 200
            assert known.get(f"{probe.url}/api/v1/status").status_code == 401
    finally:
        probe.daemon.stop()


def test_without_its_certificate_the_probe_serves_its_own_screen_alone_until_a_start_that_can_read_it(tmp_path):
    """As after a restore, which brings no key: it measures, an update finds it healthy, and the file is named."""
    hospital = own_certificate(tmp_path / "hospital", ["probe"])
    missing = tmp_path / "etc" / "probe.pem"
    card = ROOT / "models" / "simulated_probe" / "calibration.json"
    named = f'certificate = "{missing}"\ncertificate_key = "{hospital.key}"\n'
    text = f'serial = "SIM-0001"\ndata = "var"\ncalibration = "{card}"\n[server]\nhost = "0.0.0.0"\nport = 0\n'
    (tmp_path / "probe.toml").write_text(f"{text}tls_port = 0\n{named}")
    arguments = ("--simulate", "--config", "probe.toml")
    daemon = Daemon(tmp_path, arguments=arguments)
    try:
        assert listening_to_others(daemon.process.pid) == set()
        fault = next(one for one in daemon.ask("/api/v1/status").json["faults"] if one["code"] == "E021")
        assert fault["cause"].startswith(f"server.certificate names {missing}, which the user ")
        assert fault["severity"] == "warning"
        assert "start the daemon again. Until then only the probe's own screen is served" in fault["remedy"]
        assert daemon.ask("/api/v1/device").json["network"] is None
        health = ask_parts(DaemonAddress(int(daemon.url.rpartition(":")[2]), "0.0.0.0"))
        assert health.faults["store"] is None
        assert 'tsis_fault{code="E021",severity="warning"} 1.0' in daemon.ask("/metrics").body.decode()
    finally:
        assert daemon.stop() == 0
    missing.parent.mkdir()
    missing.write_bytes(hospital.certificate.read_bytes())
    daemon = Daemon(tmp_path, arguments=arguments)
    try:
        assert daemon.ask("/api/v1/device").json["network"]["certificate_sha256"] == hospital.sha256
        assert "E021" not in [one["code"] for one in daemon.ask("/api/v1/status").json["faults"]]
    finally:
        daemon.stop()


@pytest.mark.long
def test_a_probe_that_serves_one_address_has_its_own_screen_at_loopback_all_the_same(tmp_path):
    probe = NetworkedDaemon(tmp_path, host=own_address())
    try:
        assert probe.daemon.url.startswith("http://127.0.0.1:")
        assert probe.daemon.ask("/api/v1/status").status == 200
        assert probe.ask("GET", "/api/v1/status").status_code == 401
        health = ask_parts(DaemonAddress(probe.port, probe.address))  # as the updater asks
        assert health.release
        command = ["-m", "device", "--simulate", "--config", "probe.toml", "--port", str(probe.port), "status"]
        told = subprocess.run([sys.executable, *command], cwd=probe.folder, env=SHELL, capture_output=True, text=True)
        assert told.stdout.startswith("simulated probe SIM-0001"), told.stderr
    finally:
        probe.daemon.stop()
