"""The address of notices over real sockets: taken, refused, silent, by TLS with the right certificate and no other."""

import socket
import subprocess

import pytest
from notice_receiver import NoticeReceiver

from device.config import WebhookSection
from device.errors import WebhookFailed
from device.files.toml_record import InvalidRecord, from_table
from device.webhook import address
from device.webhook.address import WebhookAddress


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    folder = tmp_path_factory.mktemp("certificate")
    made = folder / "address.pem", folder / "address.key"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=address",
               "-addext", "subjectAltName=IP:127.0.0.1", "-out", made[0], "-keyout", made[1]]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True)
    return made


@pytest.fixture
def opened():
    receivers = []

    def opening(**said):
        receivers.append(NoticeReceiver(**said))
        return receivers[-1]

    yield opening
    for receiver in receivers:
        receiver.close()


@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
def test_it_follows_no_redirect(opened, status):
    elsewhere, receiver = opened(), opened()
    receiver.status, receiver.headers = status, {"Location": elsewhere.url}
    with pytest.raises(WebhookFailed, match=f"answers with {status}.*leads elsewhere"):
        WebhookAddress(receiver.url).post(b"{}", {})
    assert (receiver.asked, elsewhere.asked) == (1, 0)


@pytest.mark.parametrize("status", [400, 401, 404, 410, 429, 500, 503])
def test_only_an_answer_that_it_was_taken_is_one(opened, status):
    receiver = opened()
    receiver.status = status
    with pytest.raises(WebhookFailed, match=f"127.0.0.1:{receiver.port} answers with {status}"):
        WebhookAddress(receiver.url).post(b"{}", {})


def test_an_address_that_is_down_silent_or_speaks_no_http_is_told(opened, monkeypatch):
    monkeypatch.setattr(address, "TIMEOUT_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        with pytest.raises(WebhookFailed, match="no answer in time"):
            WebhookAddress(f"http://127.0.0.1:{port}/").post(b"{}", {})
    with pytest.raises(WebhookFailed, match="Connection refused"):
        WebhookAddress(f"http://127.0.0.1:{port}/").post(b"{}", {})
    with pytest.raises(WebhookFailed, match="does not take notices"):
        WebhookAddress("http://no-such-host.invalid/").post(b"{}", {})


def test_no_proxy_of_the_environment_is_asked(opened, monkeypatch):
    receiver, proxy = opened(), opened()
    for name in ("http_proxy", "HTTP_PROXY", "https_proxy", "all_proxy"):
        monkeypatch.setenv(name, f"http://127.0.0.1:{proxy.port}")
    receiver.status = 500
    with pytest.raises(WebhookFailed, match="500"):
        WebhookAddress(receiver.url).post(b"{}", {})
    assert proxy.asked == 0


def test_by_tls_only_a_certificate_of_the_authority_and_of_that_name_is_taken(opened, certificate):
    receiver = opened(certificate=certificate)
    receiver.status = 200
    WebhookAddress(receiver.url, certificate[0]).post(b"{}", {})
    with pytest.raises(WebhookFailed, match="its certificate is refused, self-signed certificate"):
        WebhookAddress(receiver.url).post(b"{}", {})
    by_name = f"https://localhost:{receiver.port}/"
    with pytest.raises(WebhookFailed, match="certificate is refused, Hostname mismatch"):
        WebhookAddress(by_name, certificate[0]).post(b"{}", {})
    assert receiver.asked == 1


def test_an_authority_that_is_missing_is_told(tmp_path):
    with pytest.raises(WebhookFailed, match="No such file"):
        WebhookAddress("https://127.0.0.1:1/", tmp_path / "none.pem").post(b"{}", {})


def test_what_names_an_address_names_no_path():
    assert str(WebhookAddress("https://hospital.example:8443/secret/path")) == "hospital.example:8443"


@pytest.mark.parametrize(
    "url",
    ["http://hospital.example/x", "ftp://a/", "https://user:word@a/", "https://a/?token=1", "https://a/#b", "https://",
     "https://a:99999/", "https://a\\b/", "https://a b/", "http://127.0.0.1.example/"],
)  # fmt: skip
def test_an_address_in_clear_or_with_a_secret_in_it_is_refused(url):
    with pytest.raises(InvalidRecord, match=r"url"):
        from_table(WebhookSection, {"url": url, "secret_file": "secret"})


def test_an_address_needs_a_secret():
    with pytest.raises(InvalidRecord, match=r"webhook\.secret_file"):
        from_table(WebhookSection, {"url": "https://a.example/"})
    assert from_table(WebhookSection, {}).url is None
