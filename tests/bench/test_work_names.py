"""Work against error: names, options and files that stand for a mechanism, and what is wrong with those that do not."""

import re

import pytest

import symdyn as sd
from symdyn.bench.work.asked import checked
from symdyn.bench.work.cases import named_case
from symdyn.cli import main
from symdyn.cli.mechanism import find_mechanism, find_system_under_test, is_file, title_of
from symdyn.cli.messages import Stop
from symdyn.errors import ArgumentError


def test_options_in_names_and_apart_from_them_are_checked(tmp_path):
    for name, told in (("n_link_pendulum(a)", "option n of n_link_pendulum must be of the kind int, such as 5; found 'a'"),
                       ("spatial_chain(x)", "option n of spatial_chain must be of the kind int"),
                       ("n_four_bar(x)", "option n of n_four_bar must be"), ("pendulum(3)", "pendulum takes no option")):
        with pytest.raises(ArgumentError, match=re.escape(told)):
            sd.bench(name)
    assert named_case("n_link_pendulum", None, {"n": 2}).name == "n_link_pendulum_n_2"
    assert named_case("heavy_top", None, {"orientation": "parameters"}).names[0] == "embedding"
    # The known motion is that with the usual options.
    assert named_case("lagrange_top").closed and named_case("lagrange_top", None, {"orientation": "parameters"}).closed is None
    assert list(named_case("lagrange_top", None, {"orientation": "parameters"}).variants) == [""]
    for options, told in (({"m": 2}, "has no option 'm'; it has n=5"), ({"n": 1.5}, "must be of the kind int")):
        with pytest.raises(ArgumentError, match=told):
            named_case("n_link_pendulum", None, options)
    with pytest.raises(ArgumentError, match=r"the option n is given twice: n_link_pendulum\(3\) and n=2"):
        named_case("n_link_pendulum(3)", None, {"n": 2})
    assert named_case("vehicle_on_rotating_track(False)").name == "vehicle_on_rotating_track_False"


def test_lists_that_are_empty_are_faults_and_one_name_is_a_list():
    about = named_case("pendulum", end=2.0)
    with pytest.raises(ArgumentError) as caught:
        checked([about], [], [], [], [])
    for what in ("formulations", "methods", "tolerances", "steps"):
        assert f"no {what} are named; name some, or leave them out" in str(caught.value)
    with pytest.raises(ArgumentError, match="there is no method <object"):
        checked([about], method_names=object())
    one = checked([about], "embedding", "dop853", 1e-6)
    assert (one.formulations, one.methods, one.tolerances, one.steps) == (("embedding",), ("dop853",), (1e-6,), None)


def test_a_files_name_is_answered_with_what_to_pass():
    with pytest.raises(ArgumentError, match=r"mine\.py is the name of a file; pass the System that its function system\(\) ret"):
        sd.bench("mine.py")


def test_a_users_file_is_run_once_and_its_faults_are_reported(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(
        "import symdyn as sd\n\nprint('it runs')\n\n\ndef system(orientation='angles'):\n    if orientation == 'parameters':\n"
        "        raise ValueError('there are none')\n    return sd.systems.get('pendulum')\n")
    assert main(["bench", "mine.py", "--rtol", "7"]) == 2
    told = capsys.readouterr()
    assert told.out.count("it runs") == 1
    assert "mine.py ended with ValueError:\n  File " in told.err and "there are none" in told.err
    assert "the tolerance 7.0" in told.err  # and what is wrong besides
    assert main(["bench", "pendulum", "mine.py", "--end", "0"]) == 2
    assert "the end 0.0 of pendulum must be a positive time" in capsys.readouterr().err
    (tmp_path / "mine.py").write_text("import symdyn as sd\n\n\ndef system(count):\n"
                                      "    return sd.systems.n_link_pendulum(count)\n")
    assert main(["bench", "mine.py"]) == 2
    assert "system() of mine.py needs --option count=..." in capsys.readouterr().err
    assert main(["bench", "mine.py", "n_link_pendulum", "--option", "count=2", "--end", "0", "--formulations", "embedding"]) == 2
    told = capsys.readouterr().err
    assert "the end 0.0 of mine_count_2 must be a positive time" in told
    assert "n_link_pendulum has no option 'count'; it has n=5" in told


def test_one_resolver_knows_every_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("import symdyn as sd\n\n\ndef system(count=1):\n"
                                      "    return sd.systems.n_link_pendulum(count)\n")
    assert len(find_mechanism("n_link_pendulum(3)", {}).check().bodies) == 3
    assert len(find_mechanism("n_link_pendulum", {"n": 2}).check().bodies) == 2
    assert len(find_mechanism("mine.py", {"count": 4}).check().bodies) == 4
    assert find_mechanism("heavy_top", {}).name == "heavy_top"
    assert (title_of("mine.py", {}), title_of("n_link_pendulum(3)", {})) == ("mine", "n_link_pendulum_3")
    assert find_system_under_test("mine.py", {"count": 2}, 3.0).end == 3.0
    (tmp_path / "pendulum").write_text("a program")
    assert find_mechanism("pendulum", {}).name == "pendulum" and not is_file("pendulum") and is_file("mine.py")
    for name, options, told in (("heavy_to", {}, r"did you mean heavy_top\?.*; the path of a Python file that defines system"),
                                ("n_link_pendulum(a)", {}, "must be of the kind int"),
                                ("none.py", {}, "there is no file none.py"),
                                ("mine.py", {"size": 1}, "has no option 'size'; it has count=1")):
        for find in (find_mechanism, find_system_under_test):
            with pytest.raises(Stop, match=told):
                find(name, options)
