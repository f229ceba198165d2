"""What keeps other machines from being served is named by its setting and its file, before anything listens."""

import pytest

from device.access.certificate import own_certificate
from device.config import Config, ServerSection
from device.errors import CertificateRefused
from device.web.entrance.network import open_network


@pytest.fixture
def opening(tmp_path):
    """Open the network of a probe with settings of its server; return why that is refused."""

    def refusal(**stated):
        section = ServerSection(host="0.0.0.0", tls_port=0, **{name: str(path) for name, path in stated.items()})
        with pytest.raises(CertificateRefused) as refused:
            open_network(Config(data=tmp_path / "var", server=section))
        return refused.value

    return refusal


def test_each_file_that_cannot_be_read_is_named_with_its_setting(opening, tmp_path):
    own = own_certificate(tmp_path / "hospital", ["probe"])
    none = tmp_path / "none.pem"
    for name, stated in (
        ("server.certificate", {"certificate": none, "certificate_key": own.key}),
        ("server.certificate_key", {"certificate": own.certificate, "certificate_key": none}),
        ("server.client_authority", {"client_authority": none}),
    ):
        error = opening(**stated)
        assert error.cause.startswith(f"{name} names {none}, which the user ")
        assert error.cause.endswith("cannot read: No such file or directory.")


def test_an_authority_of_clients_that_is_no_certificate_is_refused_before_the_probe_is_opened(opening, tmp_path):
    """Without it nobody could tell whose client is known: then none is let in."""
    (tmp_path / "ca.pem").write_text("no certificate")
    error = opening(client_authority=tmp_path / "ca.pem")
    assert error.cause.startswith(f"server.client_authority names {tmp_path}/ca.pem, which holds no certificates")
    assert "Until then only the probe's own screen is served." in error.remedy
