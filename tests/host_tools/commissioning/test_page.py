"""The page of a commissioning: all that was found is on it, names are escaped, and it loads and runs nothing."""

import html.parser
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from device.measurement.quantities import Bound
from device.measurement.ramp_modes.commissioned.discrepancy import NOTHING
from device.measurement.ramp_modes.commissioned.row_derivatives import MEAN, NAMES, STD
from device.measurement.ramp_modes.model import CriticalValues
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import CONTRAST, RESPONSE
from host_tools.calibration.gates import Gate
from host_tools.commissioning.believed_presses import BelievedAnswers
from host_tools.commissioning.commission import CommissionedProbe
from host_tools.commissioning.joint_fit import PROBE, BelievedErrors, ProbeFit
from host_tools.commissioning.left_out import LeftOut
from host_tools.commissioning.own_bundle import commissioned_record
from host_tools.commissioning.page import NOTHING_MORE, commissioning_page
from host_tools.commissioning.page_pictures import shares
from host_tools.commissioning.prior_discrepancy import prior_discrepancy
from host_tools.commissioning.probe_prior import LABELS
from host_tools.commissioning.report import SILICONE
from host_tools.press_models.mode_outcome import EvaluatedPresses

TRUTH = np.array([8.0, 6.0, 80.0])
VOID = {"meta", "link", "img", "br", "hr", "input"}


class Page(html.parser.HTMLParser):
    """Words below each element with an id, tags, and attributes of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes, self.words, self._open = [], [], {}, []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self._open.append((tag, dict(attrs).get("id")))

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag):
        found, _ = self._open.pop()
        assert found == tag

    def handle_data(self, data):
        for _, name in [*self._open, ("", "all")]:
            if name:
                self.words[name] = " ".join((self.words.get(name, "") + " " + data).split())


def left_out(name, **other):
    always = np.ones(3, bool)
    return LeftOut(name, TRUTH, 0.02 * TRUTH, 1.02 * TRUTH, 0.9 * TRUTH, 1.1 * TRUTH, always, 0.8, **other)


def presses(covered):
    """Return ten presses of which so many hold their truth; the modulus is determined in none."""
    truth, known = np.zeros((10, 3)), np.tile([True, True, False], (10, 1))
    middle = np.where(np.arange(10) < covered, 0.0, 0.5)[:, None] + truth
    return EvaluatedPresses(truth, middle, middle - 0.2, middle + 0.2, known)


def answered(covered):
    return BelievedAnswers(presses(covered), np.ones(10, int), np.ones(10, bool), np.ones(10))


def found(names=("A1", "A2", "block"), **believed):
    """Return a commissioning of two phantoms and a bare block, made on paper."""
    left = np.zeros((len(names), RESPONSE.stop))
    left[0, CONTRAST], left[1, RESPONSE] = 0.002, -0.003
    left[-1, CONTRAST] = np.nan
    lacking = BelievedErrors(believed.get("discrepancy_ratio", 0.0), 0.004, 0.006)
    fit = ProbeFit(
        mean=MEAN[PROBE] + 2 * STD[PROBE],
        covariance=np.diag((0.1 * STD[PROBE]) ** 2),
        log_evidence=0.0,
        misfit_ratio=np.array([0.7, 0.8, 0.9]),
        offset_mm=np.array([0.4, 3.5, np.nan]),
        left_ratio=left,
        levels=ErrorLevels(model_ratio=0.004, flat_field_ratio=0.006),
        discrepancy=prior_discrepancy(0.03) if lacking.discrepancy_ratio else NOTHING,
        believed=lacking,
    )
    missed = replace(left_out(names[1]), low=1.05 * TRUTH, value=1.2 * TRUTH, high=1.3 * TRUTH, misfit_ratio=1.1)
    gates = [Gate("largest misfit", 1.1, Bound(0.0, 2.5, ""), "record it again")]
    of_press = CriticalValues(1.43, 3.21, 4.56, 0.87)
    critical = {"standard": of_press, "precise": replace(of_press, misfit_ratio=1.29)}
    left_alone = [left_out(names[0]), missed]
    return CommissionedProbe(fit, None, critical, left_alone, answered(9), answered(7), gates, list(names))


def page(done=None, advice=(), **more):
    done = done or found()
    made_at = datetime(2026, 11, 24, tzinfo=UTC)
    card = {
        "name": "own",
        "serials": ["TSIS-0007"],
        "expires_at": "2027-11-24T09:30:00Z",
        "commissioned": commissioned_record(done, made_at, {"phantoms": "PH-7", "design": "standard"}),
    }
    return Page(commissioning_page(done, card, advice, **more))


def test_the_verdict_comes_first_in_plain_words():
    shown = page()
    verdict = shown.words["verdict"]
    assert "Probe TSIS-0007 may answer presses until 24 November 2027: all 1 gates are passed." in verdict
    assert "2 phantoms with an inclusion and 1 bare blocks" in verdict
    assert "Of 2 answers, size is determined in 2, and 1 of these hold the truth;" in verdict
    assert "modes standard and precise of serial number TSIS-0007" in verdict
    assert shown.words["all"].index("may answer presses") < shown.words["all"].index("Phantoms left out")


def test_a_gate_that_is_not_passed_is_the_verdict():
    done = found()
    shown = page(replace(done, gates=[replace(done.gates[0], value=3.0)]))
    assert "is not commissioned: 1 of 1 gates did not pass" in shown.words["verdict"]
    assert "largest misfit 3 at least 0 and at most 2.5 not passed: record it again" in shown.words["gates"]


def test_without_a_certificate_the_verdict_is_that_it_answers_no_press():
    shown = page(lacks=["lit unloaded frames of A1 is 0, but must be at least one: record it again."])
    assert "Probe TSIS-0007 answers no press yet: it has no certificate." in shown.words["verdict"]
    assert "The recordings lack: lit unloaded frames of A1 is 0" in shown.words["verdict"]
    assert "may answer presses" not in shown.words["all"]


def test_every_ramp_and_what_the_fit_leaves_of_it_is_there():
    """2 and 3 permille everywhere, by how the ramps were made; a bare block has no contrast."""
    ramps = page().words["ramps"]
    assert "A1 8 mm, 6 mm, 80 kPa 0.4 mm 2.00 0.00 0.70" in ramps
    assert "A2 8 mm, 6 mm, 80 kPa 3.5 mm 0.00 3.00 0.80" in ramps
    assert "block bare block – – 0.00 0.90" in ramps
    assert "A1 contrast 2.0 rms" in page().words["all"]


def test_the_probe_stands_beside_its_tolerances_and_is_no_measurement_of_silicone():
    shown = page()
    assert SILICONE in shown.words["all"]
    exponent = LABELS[NAMES[PROBE[0]]]
    assert f"{exponent} 0 0.2000 ± 0.0164 ± 0.164 2.0" in shown.words["directions"]
    for number in PROBE:
        assert shown.words["all"].count(LABELS[NAMES[number]]) == 2  # picture and table


def test_phantoms_left_out_limits_and_levels_are_told():
    shown = page()
    assert "A1 8: 7.2 to 8.8 6: 5.4 to 6.6 80: 72 to 88 0.80" in shown.words["answers"]
    assert "A2 8: 8.4 to 10.4 misses" in shown.words["answers"]
    for told in ("0.40 %", "0.60 %", "1.43", "3.21", "4.56", "0.87", "1.29", "above 1.43 a press is refused"):
        assert told in shown.words["all"]
    assert "standard, one press 10 100 % 100 % 90 %" in shown.words["all"]
    assert "precise, a scan 10 100 % 100 % 70 %" in shown.words["all"]


def test_a_mode_quick_of_its_own_stands_beside_the_others():
    shown = page(replace(found(), held=answered(8)))
    assert "modes quick, standard and precise of serial number TSIS-0007" in shown.words["verdict"]
    assert "quick, one hold 10 100 % 100 % 80 %" in shown.words["all"]
    assert shown.words["all"].count("quick: size") == 1  # in the picture
    assert "not trained" not in shown.words["verdict"]
    assert "mode quick, which was not trained" in page().words["verdict"]


def test_advice_is_told_and_its_absence_too():
    assert "All phantoms have one surface." in page(advice=["All phantoms have one surface."]).words["all"]
    assert NOTHING_MORE in page().words["all"]


def test_simulated_recordings_are_called_simulated():
    assert "Simulated." not in page().words["all"]
    assert "Simulated." in page(is_simulated=True).words["all"]


@pytest.mark.parametrize(("ratio", "tells"), [(0.0, False), (0.03, True)])
def test_what_the_forward_model_lacks_has_a_picture_of_its_own(ratio, tells):
    words = page(found(discrepancy_ratio=ratio)).words["all"]
    assert ("contrast: % of what an inclusion does" in words) is tells
    assert ("the likeliest discrepancy is none" in words) is not tells


def test_names_are_escaped_in_words_and_in_pictures():
    shown = page(found(names=("<b>", "$x_1$ & <script>alert(1)</script>", "block")))
    assert "b" not in shown.tags
    assert "script" not in shown.tags
    assert "<b> 8 mm" in shown.words["ramps"]
    assert "<b> contrast 2.0 rms" in shown.words["all"]
    assert shown.words["all"].count("$x_1$ & <script>alert(1)</script>") == 5  # three pictures, two tables


def test_the_page_loads_and_runs_nothing():
    shown = page()
    assert not {"script", "img", "link", "iframe", "object"} & set(shown.tags)
    assert not [name for name, _ in shown.attributes if name == "src" or name.startswith("on")]
    assert all(value.startswith(("#", "data:")) for name, value in shown.attributes if name.endswith("href"))


def test_the_ids_of_a_page_are_its_own():
    """Clips of one picture would otherwise cut another one."""
    ids = [value for name, value in page().attributes if name == "id" and not value.endswith(tuple("0123456789"))]
    clips = [value for name, value in page().attributes if name == "id" and value.startswith(("p", "m"))]
    assert len(ids) > 10
    assert len(clips) > 10


def test_the_interval_of_a_share_is_wilsons():
    """9 of 10 at 90 %: (0.9 + z2 / 20 -+ z sqrt(0.009 + z2 / 400)) / (1 + z2 / 10) with z2 = 2.7055."""
    assert shares(9, 10) == pytest.approx((0.6523, 0.9, 0.9774), abs=1e-4)
