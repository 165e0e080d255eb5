"""Small networks learn by torch's Adam, bit for bit, and start without what they do not need."""

import subprocess
import sys

import numpy as np
import pytest
import torch

from learning.networks import Network, descend_together

SIZES = (3, 8, 2)


def network(seed=0, rate=0.01):
    return Network(SIZES, learning_rate=rate, rng=np.random.default_rng(seed))


def loss_of(made, x, y):
    return torch.nn.functional.mse_loss(made.model(x), y)


@pytest.fixture
def lesson():
    rng = np.random.default_rng(4)
    return [torch.from_numpy(rng.standard_normal((16, n)).astype(np.float32)) for n in (3, 2)]


@pytest.mark.parametrize("n_steps", [1, 30])
def test_a_step_is_torchs_adam_bit_for_bit(lesson, n_steps):
    made, twin = network(), network()
    theirs = torch.optim.Adam(twin.model.parameters(), lr=0.01, betas=(0.9, 0.99), eps=1e-5, fused=True)
    for k in range(n_steps):
        if k == 10:
            made.learning_rate = theirs.param_groups[0]["lr"] = 0.002
        descend_together(loss_of(made, *lesson), made)
        theirs.zero_grad()
        loss_of(twin, *lesson).backward()
        theirs.step()
    for one, other in zip(made.model.parameters(), twin.model.parameters(), strict=True):
        assert torch.equal(one, other)


def test_what_was_saved_before_the_first_step_or_after_some_goes_on_bit_for_bit(lesson):
    for n_before in (0, 5):
        made, other = network(), network(seed=1)
        for _ in range(n_before):
            descend_together(loss_of(made, *lesson), made)
        other.load_state_dict(made.state_dict())
        for each in (made, other):
            for _ in range(3):
                descend_together(loss_of(each, *lesson), each)
        for one, its in zip(made.model.parameters(), other.model.parameters(), strict=True):
            assert torch.equal(one, its)


def test_a_network_that_a_loss_does_not_reach_stays_as_it_is(lesson):
    made, other = network(), network(seed=1)
    before = other.state_dict()["weights"]
    descend_together(loss_of(made, *lesson), made, other)
    assert all((a == b).all() for a, b in zip(other.state_dict()["weights"], before, strict=True))
    assert all(moments["step"] == 0.0 for moments in other.state_dict()["moments"])


def test_numpy_rates_with_the_memory_that_torch_trains(lesson):
    made, x = network(), lesson[0]
    descend_together(loss_of(made, *lesson), made)
    assert made.rate(x.numpy().copy()) == pytest.approx(made.model(x).detach().numpy(), abs=1e-6)


def test_learning_starts_without_torchs_compiler():
    program = (
        "import sys, numpy as np\n"
        "from learning.networks import Network\n"
        "Network((3, 8, 2), learning_rate=0.01, rng=np.random.default_rng(0))\n"
        "sys.exit('torch._dynamo' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_descent_by_a_slope_is_autograds_bit_for_bit(lesson):
    x, y = lesson
    made, twin = (Network((3, 8, 8, 1), learning_rate=0.01, rng=np.random.default_rng(3)) for _ in range(2))
    for _ in range(20):
        u = twin.model(x)[:, 0]
        twin.descend(torch.nn.functional.smooth_l1_loss(u, y[:, 0], beta=0.1))

        def slope(u):
            return torch.ops.aten.smooth_l1_loss_backward(torch.ones(len(u)) / len(u), u, y[:, 0], 0, 0.1)

        made.descend_by(x.numpy(), slope)
    for one, other in zip(made.model.parameters(), twin.model.parameters(), strict=True):
        assert torch.equal(one, other)
