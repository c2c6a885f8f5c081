"""What takes long, by the beginnings of test names: `make test` leaves it out, `make test-all` runs it.

Each entry says which quicker test guards the same promise; docs/decisions/019 has the figures. CPU seconds were measured.
"""

# Beginning of a node id -> what guards the promise in `make test`.
SLOW = {
    **{
        f"tests/children/test_no_orphans.py::test_a_command_that_is_killed_leaves_nothing_behind[{command}]": "the same test on the commands whose children these start; test_poisoned_folder.py: no room starts any on its own"
        for command in (
            *("diagnose", "discover", "learn", "add", "convert", "import", "models", "regress bisect"),
            *("hil check", "hil compile", "hil identify", "hil record", "hil robot", "hil stimulate"),
        )
    },
    **{
        f"tests/greybox/test_delays.py::test_{name}": "the same file: the only sensor is late, and how that is written"
        for name in (
            "sensors_that_are_all_late_are_called_like_a_late_input[measured1]",
            "a_late_sensor_of_an_fmu",
            "one_late_sensor_of_two",
        )
    },
    "tests/greybox/test_plants_of_users.py::test_a_hole_in_a_tank": "the same file on a leak of charge, test_laws.py on the law",
    **{
        f"tests/greybox/test_rare_laws.py::test_{name}": "the same file on magnets, test_laws.py on every law"
        for name in (
            *(
                f"a_rare_law_is_named_with_its_values[{law}]"
                for law in ("rate", "saturation", "load", "moment", "square", "shaking", "dead_zone", "cube")
            ),
            "a_lag_of_a_linear_plants_input",
            "friction_that_grows_with_the_position",
        )
    },
    # Diagnoses of shipped cases, 28 to 56 s each; case_003 stays with fewer rows.
    **{
        f"tests/diagnosis/test_shipped_cases.py::test_hidden_effects_of_the_arm_are_named_sized_within_three_percent_and_the_error_falls[{case}]": "the same file on two trials of case_003, and test_pendulum.py on a real machine"
        for case in ("case_003", "case_004", "case_007", "case_008", "case_009")
    },
    **{
        f"tests/diagnosis/test_shipped_cases.py::test_{name}": "the same file on two trials of case_003, and test_pendulum.py on a real machine"
        for name in (
            "hidden_effects_of_the_arm_are_named_sized_within_three_percent_and_the_error_falls[case_010]",
            "real_muscle",
            "same_input_gives_the_same_result",
        )
    },
    "tests/diagnosis/test_latent.py::test_effects_that_together": "greybox/test_unnamed.py on two other forces; the same file on the curve",
    "tests/gp/test_calibration.py::test_ninety_percent_intervals_hold_about_ninety_percent_where_those_of_the_best_fit_hold_fewer[12-24]": "the same test on 40 data, and on a block with a dozen",
    "tests/diagnosis/test_shipped_cases.py::test_effect_that_no_given_card_explains": "test_latent.py: a pendulum whose law no card has; test_verdict.py: the rule",
    "tests/hil/test_compiled_decision.py::test_compiled_and_as_python": "the rest of that file: what is found where, and test_safety_core.py on the source of both",
    # Whole diagnoses through the command line and by clicks, 30 to 73 s each.
    "tests/test_studio_pictures.py::test_the_build_takes": "the rest of that file, and tests/studio on each page",
    "tests/test_command_line.py::test_discover_then_ledger": "diagnosis/test_user_cards.py: diagnosed and added through the command line; greybox/test_diagnose_plain_models.py: discovered",
    "tests/test_command_line.py::test_fmu_and_modelica_model_show_the_same_error": "house/test_front_door.py: a model and its FMU give the same figures",
    "tests/test_command_line.py::test_add_writes": "house/test_front_door.py: an effect gives a new model",
    "tests/test_command_line.py::test_results_survive_kill_9": "diagnosis/test_work.py: a diagnosis that was killed goes on and ends the same",
    "tests/studio/test_main_job_by_clicks.py": "studio/test_first_screen.py, test_import_wizard.py and test_studio_jobs.py: each screen and the job",
    "tests/diagnosis/test_shipped_cases.py::test_nothing_is_named_when_nothing_is_missing": "test_excitation.py: a rich record of a right model is adequate",
    **{
        f"tests/diagnosis/test_cards.py::test_card_attaches_to_a_model_and_its_values_arrive_in_modelica[{card}": "the same test on the first form of each card"
        for card in (
            *(
                "constant_forcejoint",
                "coulomb_frictionslide",
                "end_stopbelow",
                "joint_offsetlevel",
                "joint_offsetslide",
            ),
            *("joint_scalelevel", "joint_scaleslide", "quadratic_dragjoint", "quadratic_dragslide"),
            *("recruitment_curvesigmoid", "saturationdrive", "saturationinflow", "sensor_laglevel", "sensor_lagslide"),
            *("stimulation_delaydrive", "stimulation_delayinflow", "stribeck_frictionslide", "viscous_frictionslide"),
        )
    },
    "tests/benchmarks/diagnosis/test_fixed_cases.py": "tests/diagnosis/test_shipped_cases.py: named, nothing missing, unknown",
    "tests/gp/test_learning_from_trials.py::test_a_brake_that_a_model_of_ones_own": "models/test_correction.py: forces at balances; the same on the arm",
    "tests/gp/test_learning_from_trials.py::test_torques_that_stay": "models/test_held_inputs.py: the missing force under held torques",
    "tests/diagnosis/test_excitation.py::test_muscle_that_is_never_stimulated": "test_next_experiment.py: silent muscles and machines at rest, effect by effect",
    "tests/diagnosis/test_work.py::test_scheduler_that_does_not_answer": "cosim/test_run_command.py: the same line of a sweep",
    "tests/greybox/test_unnamed.py::test_laws_that_come_near_a_force_of_no_library_are_the_best_set_and_not_named[quintic": "the same test on another force",
    "tests/diagnosis/test_p_values_of_right_models.py": "test_noise_floor.py and test_flexible.py: the noise that p-values rest on",
    "tests/blackbox/test_diagnosis_of_an_fmu.py::test_effect_in_the_data_is_named_from_outside_the_fmu": "test_hidden_effects_on_plants.py on tanks",
    "tests/blackbox/test_diagnosis_of_an_fmu.py::test_command_line_names_the_effect": "test_hidden_effects_on_plants.py on tanks; test_coupled_systems.py writes a system",
    "tests/blackbox/test_coupled_systems.py::test_comparison_is_that": "the same file: an effect at a connected force explains the data",
    "tests/blackbox/test_hidden_effects_on_plants.py::test_hidden_effect_is_named_and_its_size_found[pendulum": "the same test on tanks",
    "tests/blackbox/test_hidden_effects_on_plants.py::test_hidden_effect_is_named_and_its_size_found[two-mass": "the same test on tanks",
    "tests/greybox/test_plants_of_users.py::test_a_slow_thermocouple": "test_delays.py on a late sensor; test_slow_errors.py on a store of heat",
    "tests/greybox/test_sensors_and_memory.py::test_friction_that_develops": "laws/test_vocabulary.py on terms with a memory; test_laws.py on every law",
    "tests/greybox/test_sensors_and_memory.py::test_a_wrong_zero": "the same file on a wrong scale; test_delays.py: two names of one effect stay two",
    "tests/greybox/test_late_sensors.py": "test_delays.py: the only sensor is late, and the input takes its place",
    "tests/greybox/test_elastic_drives.py::test_a_load_on_a_spring_is_named": "the written model in the same file, test_laws.py on every law",
    "tests/greybox/test_wrong_parameters.py::test_four": "test_laws.py on every law, and laws/test_discovered_laws.py on records without a law",
    "tests/greybox/test_balances_of_fmus.py::test_dry_friction_that_an_fmu_lacks": "the same file on a wrong value, and on friction at a rate of the FMU that is written into it",
    "tests/greybox/test_balances_of_fmus.py::test_dry_friction_is_named_though_an_effect": "the same file on a wrong value of an FMU",
    # The gallery: a converter at half its rate and five machines without an effect stay.
    "tests/test_gallery.py::test_the_hidden_effect": "test_half_the_samples_of_a_converter in the same file, and greybox/test_gallery_effects.py",
    **{
        f"tests/test_gallery.py::test_nothing_is_named_where_the_machine_moves_as_its_model_says[{case}]": "the same test on five other machines"
        for case in ("battery", "cylinder", "geared_motor")
    },
    "tests/diagnosis/test_tolerances_in_the_patched_model.py::test_patched_model_errs": "the other tests of its file: the value arrives, its neighbours stay",
    "tests/diagnosis/test_failing_candidates.py::test_a_candidate_that_breaks_is_told_with_its_reason_and_the_others_go_on[error1": "the same test on another error",
    "tests/laws/test_discovered_laws.py::test_random_forces_give_no_formula": "the same file on noise of which a formula is asked for",
    "tests/fmus/test_build.py::test_a_model_that_cannot_be_compiled_says_why[2": "the same test with one worker",
    "tests/fmus/test_source_only.py::test_sources_are_compiled_and_run[3.0": "the same test in FMI 2.0",
    # FMUs in tools of others and under sanitizers and valgrind.
    "tests/fmus/test_importers.py": "test_behaviour.py and test_validate_command.py: our own checks of the same FMUs",
    "tests/fmus/test_exercise.py": "test_bad_calls.py and test_behaviour.py, without sanitizers",
    "tests/fmus/test_oracle.py::test_every_variable_takes_the_course_that_rumoca_computes[arm": "the same test on the smaller models",
    "tests/fmus/test_oracle.py::test_every_variable_takes_the_course_that_rumoca_computes[DoublePendulum": "the same test on the smaller models",
    **{
        f"tests/fmus/test_oracle.py::test_every_variable_takes_the_course_that_rumoca_computes[{model}]": "the same test on the smaller models"
        for model in ("rat-muscle", "drive", "linear-drive", "cart", "two-mass", "double-pendulum", "tanks")
    },
    "tests/fmus/test_behaviour.py::test_an_fmu_that_misbehaves_is_a_finding[2.0": "the same faults in FMI 3.0",
    "tests/fmus/test_build.py::test_both_versions_of_all_models_are_built_side_by_side": "test_build_command.py builds one model in both versions",
    # Whole sites, packages, notebooks, teams.
    **{
        f"tests/test_documentation.py::test_commands_of_a_page_run_one_after_another[{page}": "the same test on the other pages; each command and option of these exists"
        for page in (
            "README.md",
            "rat_muscle.md",
            "gp.md",
            "bench_session.md",
            "name_an_effect.md",
            "regress.md",
            "identify_a_robot.md",
            "bench.md",
            "black_box_fmus.md",
            "data_checks.md",
            "laws.md",
            "scale.md",
            "study.md",
            "python.md",
            "effect_cards.md",  # diagnosis/test_user_cards.py: the same card and records
            "bench_view.md",  # hil/test_bench_view.py, hil/test_view.py
        )
    },
    "tests/test_documentation_site.py": "test_documentation.py: links and commands of pages; house/test_public_list.py: the reference",
    "tests/test_wheel.py::test_the_wheel_builds": "the same file: the front door, and the files that it needs",
    "tests/report/test_notebook.py::test_example_notebook_runs": "house/test_front_door.py: the same calls",
    "tests/regress/test_worked_example.py": "test_regress_command.py and test_pytest_plugin.py",
    "tests/regress_comparison/test_mutants_are_caught.py": "the other files of its folder, comparison by comparison",
    # Every fault in every phase of a session; faults while the arm moves stay.
    **{
        f"tests/hil/test_faults.py::test_no_fault_brings_a_torque_beyond_its_limit_or_before_arming[{phase}": "the same faults in phase 'run'"
        for phase in ("scan", "wake", "zero", "arm", "stop")
    },
    "tests/hil/test_faults.py::test_the_documented_matrix": "test_a_running_arm_reacts_in_time_and_says_why: one column of it",
    # The bench as processes: one way to end stays.
    "tests/hil/test_processes.py::test_a_polite_end_lets_the_arm_down_and_finishes_the_recording[1]": "the same test with signal 15",
    "tests/hil/test_processes.py::test_a_polite_end_lets_the_arm_down_and_finishes_the_recording[2]": "the same test with signal 15",
    "tests/hil/test_burden.py::test_a_session_finds_out": "test_identify.py: the set obeys the robot's equation; the other tests of its file",
    "tests/hil/test_cia402.py::test_a_hold_with_virtual_drives_is_recorded_and_replays": "the other tests of its file, in virtual time",
    "tests/hil/test_trials.py::test_a_trial_with_lost_answers": "the session without a fault in the same file; test_faults.py on lost answers",
    "tests/regress/test_pytest_plugin.py::test_cases_and_own_tests_run_on_two": "the same file: the same cases in one process, and the last failure alone",
    # Draws of the benchmark's cases; drive, pendulum and tanks stay.
    **{
        f"tests/benchmarks/diagnosis/test_truth_simulator.py::test_effect_reaches_the_wanted_size_against_the_noise[{machine}": "the same test on other machines"
        for machine in ("arm", "double-pendulum", "two-mass", "cart")
    },
    # 5,000 runs of a pair, 8 s each.
    "tests/cosim/test_many_runs.py::test_5000_runs_take_no_more_memory": "test_1000_runs_leave_nothing_behind in the same file",
    # Browsers.
    "tests/studio/test_bench_view_in_browser.py": "studio_views: the same pages without a browser",
    "tests/studio/test_uploaded_fmus_are_isolated.py::test_fmu_that_dies_is_told_in_one_line_and_the_studio_lives[exit": "the same test with a segmentation fault",
    "tests/studio/test_studio_in_browser.py::test_every_page_of_the_navigation_is_accessible_and_fits[tablet": "the same test at the size of a screen",
    "tests/studio/test_studio_in_browser.py::test_cancel_in_one_session": "test_studio_jobs.py: a job is cancelled, by another server, too; test_uploaded_fmus_are_isolated.py: by a click",
    "tests/studio/test_studio_in_browser.py::test_another_server": "test_studio_projects.py: another server finds every project; test_gate.py: the link that opens it",
    "tests/studio/test_studio_in_browser.py::test_pages_are_dark": "test_first_screen.py: read in light and in dark, with axe",
    "tests/studio/test_linked_views_in_browser.py": "studio_views: the same pages without a browser",
    "tests/studio/test_arm_replay_in_browser.py": "report/test_arm_replay.py: the same markup",
    "tests/studio/test_reports_in_browser.py": "report/test_report_html.py: the same markup",
    "tests/studio/test_swap_view_in_browser.py": "test_swap_interface.py: the same view without a browser",
}

# Files that take longest: they begin first, so that no process waits for the other one at the end.
FIRST = (
    "tests/test_command_line.py",
    "tests/diagnosis/test_shipped_cases.py",
    "tests/diagnosis/test_work.py",
    "tests/diagnosis/test_excitation.py",
    "tests/test_documentation.py",
    "tests/studio/test_uploaded_fmus_are_isolated.py",
    "tests/studio/test_studio_in_browser.py",
    "tests/hil/test_processes.py",
    "tests/cosim/test_fault_table.py",
    "tests/hil/test_robot_component.py",
    "tests/studio/test_first_screen.py",
    "tests/laws/test_discovered_laws.py",
    "tests/hil/test_trials.py",
    "tests/diagnosis/test_cards.py",
    "tests/regress/test_pytest_plugin.py",
    "tests/greybox/test_diagnose_plain_models.py",
    "tests/diagnosis/test_pendulum.py",
    "tests/greybox/test_plants_of_users.py",
    "tests/greybox/test_rare_laws.py",
    "tests/test_gallery.py",
)


def is_slow(node: str) -> bool:
    """Whether a test is left out of `make test`."""
    return any(node.startswith(beginning) for beginning in SLOW)


def turn(node: str) -> int:
    """When the file of a test begins: those that take longest in their order, then all others."""
    file = node.partition("::")[0]
    return FIRST.index(file) if file in FIRST else len(FIRST)
