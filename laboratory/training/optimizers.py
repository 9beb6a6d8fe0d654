"""Optimizers of the weights: Muon for the kernels, AdamW for batch norm and the output layer.

Muon makes each step of a kernel, taken as a matrix, orthogonal (Jordan 2024, "Muon: an optimizer for hidden layers in
neural networks"). Its steps are scaled to the size of AdamW's, so that both use one learning rate.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

WEIGHT_DECAY = 1e-5


class Optimizers:
    """Muon and AdamW as one optimizer.

    The network has channels innermost in memory, where a kernel is a matrix without copying.
    """

    def __init__(self, network: nn.Module) -> None:
        self._parameters = list(network.parameters())
        convolutions = [module for module in network.modules() if isinstance(module, nn.Conv2d)]
        self._kernels = [module.weight for module in convolutions if module.bias is None]
        self._matrices = [nn.Parameter(_matrix(kernel.detach())) for kernel in self._kernels]
        kernels = {id(kernel) for kernel in self._kernels}
        rest = [parameter for parameter in self._parameters if id(parameter) not in kernels]
        self._parts = (
            torch.optim.Muon(self._matrices, weight_decay=WEIGHT_DECAY, adjust_lr_fn="match_rms_adamw"),
            torch.optim.AdamW(rest, weight_decay=WEIGHT_DECAY),
        )

    def zero_grad(self) -> None:
        """Delete the gradients."""
        for parameter in self._parameters:
            parameter.grad = None

    def step(self, rate: float) -> None:
        """Change the weights by one step with a learning rate."""
        for matrix, kernel in zip(self._matrices, self._kernels):
            matrix.grad = None if kernel.grad is None else _matrix(kernel.grad)
        for part in self._parts:
            for group in part.param_groups:
                group["lr"] = rate
            part.step()

    def state_dict(self) -> list[dict]:
        """Return the states of both optimizers for a checkpoint."""
        return [part.state_dict() for part in self._parts]

    def load_state_dict(self, states: list[dict]) -> None:
        """Restore the states from a checkpoint."""
        for part, state in zip(self._parts, states):
            part.load_state_dict(state)


def _matrix(kernel: Tensor) -> Tensor:
    """View (out, in, side, side) as (out, side x side x in), one row per filter."""
    return kernel.permute(0, 2, 3, 1).flatten(1)
