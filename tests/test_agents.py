"""Training, evaluating, counting, saving and filming agents; all with budgets of some hundred steps."""

import numpy as np
import pytest
import torch
from PIL import Image

from stairlab import StairWorld, uniform_prototypes
from stairlab.agents import (
    ALGORITHMS,
    check_settings,
    count_parameters,
    load_agent,
    make_env,
    play,
    play_episode,
    save_agent,
    train,
)

SHORT = {"total_timesteps": 300, "eval_every": 100, "progress": False}
QUICK = {"dqn": {"learning_starts": 50}, "sac": {"learning_starts": 50, "batch_size": 32}}


@pytest.fixture(scope="module")
def motions():
    return uniform_prototypes(StairWorld())


@pytest.fixture(scope="module")
def dqn(motions):
    return train("dqn", motions, 0, **SHORT, **QUICK["dqn"])


@pytest.fixture(scope="module")
def sac():
    return train("sac", None, 0, **(SHORT | {"total_timesteps": 100}), **QUICK["sac"])


@pytest.fixture
def no_learning(monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("nothing must be trained")

    for algorithm in ALGORITHMS.values():
        monkeypatch.setattr(algorithm, "learn", refuse)


def weights(training):
    return torch.cat([parameter.detach().flatten() for parameter in training.model.policy.parameters()])


def test_evaluations_come_every_so_many_steps_with_return_length_and_height(dqn):
    table = dqn.evaluations
    assert table["step"].tolist() == [100, 200, 300]
    assert list(table) == ["step", "episode", "return", "length", "climbed"]
    assert table["length"].between(1, 50).all()
    assert (table["return"] <= 15).all()
    assert dqn.score() == table["return"].mean()
    assert dqn.wall_time > 0


def test_training_twice_gives_equal_networks_and_evaluations(dqn, motions):
    again = train("dqn", motions, 0, **SHORT, **QUICK["dqn"])
    assert torch.equal(weights(again), weights(dqn))
    assert again.evaluations.equals(dqn.evaluations)
    other = train("dqn", motions, 1, **SHORT, **QUICK["dqn"])
    assert not torch.equal(weights(other), weights(dqn))


@pytest.mark.slow
def test_training_sac_twice_gives_equal_networks_too(sac):
    again = train("sac", None, 0, **(SHORT | {"total_timesteps": 100}), **QUICK["sac"])
    assert torch.equal(weights(again), weights(sac))
    assert again.evaluations.equals(sac.evaluations)


@pytest.mark.slow
def test_evaluating_does_not_change_the_training(dqn, motions):
    rarely = train("dqn", motions, 0, **(SHORT | {"eval_every": 300}), **QUICK["dqn"])
    assert torch.equal(weights(rarely), weights(dqn))
    noise = {"env_options": {"actuation_noise": 0.05}}
    one = train("dqn", motions, 0, **SHORT, **noise, eval_episodes=1, **QUICK["dqn"])
    five = train("dqn", motions, 0, **SHORT, **noise, eval_episodes=5, **QUICK["dqn"])
    assert torch.equal(weights(one), weights(five))
    assert len(five.evaluations) == 15
    assert five.evaluations["episode"].tolist() == [0, 1, 2, 3, 4] * 3


def test_who_watches_sees_the_agent_before_the_first_jump_and_after_each_evaluation_with_all_so_far(dqn, motions):
    seen = []
    watched = train(
        "dqn",
        motions,
        0,
        **SHORT,
        **QUICK["dqn"],
        watch=lambda model, table: seen.append((model.num_timesteps, len(table))),
    )
    steps = dqn.evaluations["step"].tolist()
    assert seen == [(0, 0), *((step, number) for number, step in enumerate(steps, 1))]
    assert watched.evaluations.equals(dqn.evaluations)
    assert torch.equal(weights(watched), weights(dqn))


def test_published_settings_are_the_default_and_all_settings_are_kept(dqn, motions):
    default = train("dqn", motions, 0, total_timesteps=10, eval_every=5, progress=False)
    assert default.model.learning_starts == 3000
    assert default.settings["learning_starts"] == 3000
    assert dqn.settings["learning_starts"] == 50
    assert dqn.settings["motions"] == motions.motions.tolist()
    assert {"torch", "stable-baselines3", "stairlab"} <= set(dqn.versions)


def test_sixteen_actions_give_the_published_parameter_counts(dqn, sac):
    assert count_parameters(dqn.model) == {
        "deciding": 5_520,
        "trained": 5_520,
        "with targets": 11_040,
        "as published": 5_520,
    }
    assert count_parameters(sac.model) == {
        "deciding": 68_100,
        "trained": 203_782,
        "with targets": 339_464,
        "as published": 475_146,
    }
    with pytest.raises(TypeError, match="model must be a DQN or a SAC"):
        count_parameters("dqn")


def test_torch_has_as_many_threads_after_training_as_before(motions):
    before = torch.get_num_threads()
    train("dqn", motions, 0, total_timesteps=5, eval_every=5, progress=False)
    assert torch.get_num_threads() == before


@pytest.mark.parametrize("method", ["dqn", "sac"])
def test_an_agent_is_saved_loaded_and_plays_the_same(method, request, motions, tmp_path):
    model = request.getfixturevalue(method).model
    save_agent(model, tmp_path / "agent.zip")
    with pytest.warns(UserWarning, match="can run any code"):
        loaded = load_agent(tmp_path / "agent.zip")
    env = make_env(motions if method == "dqn" else None)
    assert play_episode(loaded, env) == play_episode(model, env)
    assert [path.name for path in tmp_path.iterdir()] == ["agent.zip"]


@pytest.mark.filterwarnings("ignore:.*can run any code")
def test_a_file_that_is_no_agent_is_refused(tmp_path):
    (tmp_path / "agent.zip").write_text("nonsense")
    with pytest.raises(ValueError, match="must be an agent saved by Stable-Baselines3"):
        load_agent(tmp_path / "agent.zip")
    with pytest.raises(FileNotFoundError):
        load_agent(tmp_path / "missing.zip")


@pytest.mark.slow
def test_a_film_has_a_frame_for_the_start_and_each_jump(dqn, motions, tmp_path):
    played = play(dqn.model, tmp_path / "film.gif", motions)
    with Image.open(tmp_path / "film.gif") as film:
        assert film.size == (900, 600)
        assert 1 <= film.n_frames <= played["length"] + 1
    played = play(dqn.model, tmp_path / "film.mp4", motions)
    assert (tmp_path / "film.mp4").stat().st_size > 1000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.gif", "film.mp4"]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (("ppo", None), ValueError, "method must be one of 'dqn', 'sac'"),
        (("dqn", None), ValueError, "motions must be given for 'dqn'"),
        (("sac", [[500, 45]]), ValueError, "and not for 'sac'"),
        (("dqn", [[500, 45], [500, 45]]), ValueError, "more than once"),
        (("dqn", np.empty((0, 2))), ValueError, "at least 1 row"),
        (("dqn", [[500, 45]], -1), ValueError, "seed must be at least 0"),
        (("dqn", [[500, 45]], 0, 0), ValueError, "total_timesteps must be at least 1, not 0"),
        (("dqn", [[500, 45]], 0, 10.5), TypeError, "total_timesteps must be a whole number"),
        (("dqn", [[500, 45]], 0, 20), ValueError, r"eval_every must be at most total_timesteps \(20\).* not 500"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_trained(arguments, error, message, no_learning):
    with pytest.raises(error, match=message):
        train(*arguments)


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"eval_every": 0}, ValueError, "eval_every must be at least 1, not 0"),
        ({"watch": 3}, TypeError, "watch must be a function of the agent and its evaluations, not 3"),
        ({"eval_episodes": "five"}, TypeError, "eval_episodes must be a whole number, not 'five'"),
        ({"env_options": 5}, TypeError, r"env_options must be a dict, such as \{'n_steps': 4\}, not 5"),
        ({"env_options": {"steps": 4}}, TypeError, "steps"),
        ({"learning_rat": 1e-3}, ValueError, "dqn has no setting 'learning_rat'; did you mean 'learning_rate'?"),
        ({"ent_coef": 0.1}, ValueError, "dqn has no setting 'ent_coef'; "),
        ({"device": "cuda"}, ValueError, "dqn has no setting 'device'; there are learning_rate, .*, verbose"),
        ({"learning_starts": "many"}, TypeError, "learning_starts must be a whole number, not 'many'"),
        ({"learning_rate": "fast"}, TypeError, "learning_rate must be a number, not 'fast'"),
        ({"gamma": None}, TypeError, "gamma must be a number, not None"),
        ({"gamma": np.nan}, ValueError, "gamma must be finite"),
        ({"optimize_memory_usage": "yes"}, TypeError, "optimize_memory_usage must be True or False, not 'yes'"),
    ],
)
def test_settings_that_there_are_not_or_of_another_type_are_refused_by_name(settings, error, message, no_learning):
    with pytest.raises(error, match=message):
        train("dqn", [[500, 45]], **settings)


def test_settings_of_every_kind_that_the_algorithms_take_are_accepted():
    check_settings("dqn", {"learning_rate": lambda left: 1e-3 * left, "train_freq": (4, "step"), "max_grad_norm": 0.5})
    check_settings("dqn", {"batch_size": np.int64(64), "gamma": np.float32(0.5), "policy_kwargs": {"net_arch": [8]}})
    check_settings("sac", {"ent_coef": "auto_0.1", "gradient_steps": -1, "use_sde": True, "tau": 1})


def test_a_film_must_be_a_gif_or_an_mp4(dqn, motions, tmp_path):
    with pytest.raises(ValueError, match=r"must be one of '.gif', '.mp4', not '.avi'"):
        play(dqn.model, tmp_path / "film.avi", motions)
