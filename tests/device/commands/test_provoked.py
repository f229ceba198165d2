"""Every code of the table is provoked: by a scenario of the virtual probe, or by the test that is named here.

A new code without either fails with what to add.
"""

import ast
from functools import cache

import pytest
from daemon_process import ROOT

from device.fault_table import FAULTS
from device.simulation.scenario import read_scenario

PROVOKED_BY = {
    "E000": "device/web/test_problems.py::test_an_error_that_nobody_foresaw_tells_the_client_nothing_of_the_inside",
    "E001": "device/test_device_command_line.py::test_the_settings_of_another_probe_are_refused_for_the_simulated_one",
    "E002": "device/settings/test_last_good.py::"
    "test_with_bad_files_the_last_good_settings_are_used_with_a_warning_of_its_own_code",
    "E013": "device/records/test_updates.py::"
    "test_an_update_taken_back_is_a_lasting_warning_until_the_next_one_is_installed",
    "E010": "device/update/test_refusals.py::test_a_flipped_byte_is_refused_wherever_it_is",
    "E011": "device/update/test_refusals.py::test_what_is_not_for_this_probe_is_refused",
    "E012": "device/update/test_full_disk.py::test_a_disk_without_space_is_told_before_anything_is_written",
    "E014": "device/records/test_schema.py::test_what_a_newer_release_wrote_is_refused_and_left_as_it_is",
    "E020": "device/records/test_audit.py::test_what_was_changed_is_found_and_its_row_named",
    "E021": "device/access/test_certificate.py::test_files_that_are_none_or_do_not_belong_together_are_refused",
    "E022": "device/web/entrance/test_certificate_watch.py::"
    "test_the_end_of_a_certificate_is_told_a_month_before_it_and_after_it_by_a_steady_clock",
    "E030": "device/dicom/test_sender.py::test_an_archive_that_is_down_is_told_of_and_gets_all_once_it_is_there",
    "E031": "device/dicom/test_sender.py::test_what_the_archive_refuses_is_told_of_until_it_is_sent_again",
    "E032": "device/webhook/test_notifier.py::test_an_address_that_is_down_is_told_of_and_gets_all_once_it_is_there",
    "E603": "test_kept_over_restart.py::test_a_damaged_database_starts_at_fault_and_shows_what_can_be_read",
    "E604": "device/records/test_recordings.py::"
    "test_a_recording_that_was_changed_is_not_handed_out_while_its_numbers_are",
    "E605": "device/records/test_recordings.py::"
    "test_a_recording_that_a_kill_left_without_its_row_is_set_aside_and_told",
    "E607": "device/instrument/watch/test_backup_watch.py"
    "::test_what_no_backup_holds_for_too_long_is_warned_of_until_there_is_one",
    "E904": "test_kept_over_restart.py::test_a_press_that_a_kill_broke_off_and_the_last_result_are_told_after_it",
    "E801": "test_press_to_result.py::"
    "test_a_second_press_or_a_tare_is_refused_while_one_is_under_way_and_a_cancelled_one_says_so",
    "E802": "test_press_to_result.py::test_bad_requests_are_problem_documents_with_a_remedy",
    "E803": "test_press_to_result.py::test_bad_requests_are_problem_documents_with_a_remedy",
    "E804": "test_press_to_result.py::test_bad_requests_are_problem_documents_with_a_remedy",
    "E805": "device/web/test_app.py::test_a_mode_without_a_model_is_refused_with_its_own_code",
    "E806": "device/access/test_request_rules.py::test_a_name_that_is_none_of_this_machines_is_refused_for_any_method",
    "E807": "device/access/test_request_rules.py::test_a_page_of_another_origin_cannot_change_anything",
    "E808": "device/access/test_request_rules.py::test_what_a_page_may_send_anywhere_without_leave_is_refused",
    "E809": "device/web/test_guard.py::test_a_body_that_says_it_is_too_large_is_refused_without_being_read",
    "E810": "device/records/test_store.py::test_a_key_that_came_with_another_request_is_refused_by_its_name",
    "E812": "device/records/test_updates.py::test_without_an_updater_nothing_is_taken",
    "E813": "device/web/test_kept_files.py::test_what_a_rule_has_deleted_is_gone_and_no_failure",
    "E814": "device/web/test_dicom.py::"
    "test_beside_two_queries_of_a_silent_worklist_a_third_is_refused_at_once_and_the_rest_is_answered",
    "E815": "device/instrument/press/test_requests.py"
    "::test_a_press_into_an_exam_of_before_its_longest_time_is_refused_and_nothing_is_kept",
    "E818": "device/dicom/test_untrusted.py::test_why_tls_fails_is_told_with_what_to_do",
    "E811": "device/records/test_exams.py::test_a_change_of_what_somebody_else_has_changed_meanwhile_is_refused",
    "E820": "device/web/entrance/test_door.py::test_without_a_token_that_holds_nothing_is_answered_but_what_is_open",
    "E821": "device/web/entrance/test_door.py::test_each_scope_is_let_in_to_what_it_may_and_to_nothing_else",
    "E822": "device/web/test_pairing.py::test_a_wrong_code_a_used_one_and_none_are_answered_alike",
    "E823": "device/web/test_pairing.py::test_who_guesses_waits",
    "E824": "device/web/entrance/test_door.py::test_in_clear_no_other_machine_is_answered_with_whatever_token",
    "E903": "test_unclean_end.py::test_a_kill_is_a_warning_after_the_next_start_and_only_after_that",
    "E902": "test_watchdog_restart.py::test_a_frozen_loop_is_a_fault_on_the_screen_then_a_restart_that_says_why",
}
"""What no scene provokes, but a request, a file or a restart: file below tests/ and test, which names the code."""
FOUND_AT_START = {"E603", "E604", "E605", "E607"}
"""What lies on the disk since an earlier run, before any scene begins."""
NO_PARTS = {"0": "settings files and the daemon itself", "8": "requests", "9": "a restart"}


@cache
def codes_of_scenarios():
    """tests/device/test_scenarios.py runs each of these and waits for its code."""
    return {read_scenario(path).expects for path in (ROOT / "scenarios").glob("*.toml")} - {""}


@pytest.mark.parametrize("code", [fault.code for fault in FAULTS])
def test_a_code_is_provoked_by_a_scenario_or_by_a_named_test(code):
    assert code in codes_of_scenarios() | set(PROVOKED_BY), (
        f'Nothing provokes {code}: add a scenarios/*.toml with `expects = "{code}"` and its row in '
        "docs/simulated_probe.md, or, where no scene can, a test that provokes it and names it, "
        f"and put that test into PROVOKED_BY of {__file__}."
    )


@pytest.mark.parametrize("code", sorted(PROVOKED_BY))
def test_a_test_that_is_named_for_a_code_exists_and_names_it(code):
    file, _, name = PROVOKED_BY[code].partition("::")
    text = (ROOT / "tests" / file).read_text(encoding="utf-8")
    tests = {node.name: node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}
    assert name in tests, f"{file} has no test {name}"
    with_marks = [tests[name], *tests[name].decorator_list]
    assert any(f'"{code}' in (ast.get_source_segment(text, node) or "") for node in with_marks), f"it names no {code}"


def test_every_fault_of_a_part_of_the_probe_has_a_scenario():
    assert {code[1] for code in PROVOKED_BY.keys() - FOUND_AT_START} <= set(NO_PARTS)
    assert {fault.code for fault in FAULTS if fault.code[1] not in NO_PARTS} <= (codes_of_scenarios() | FOUND_AT_START)


def test_a_code_is_not_named_in_both_places_and_only_if_it_exists():
    assert not codes_of_scenarios() & set(PROVOKED_BY)
    assert codes_of_scenarios() | set(PROVOKED_BY) <= {fault.code for fault in FAULTS}
