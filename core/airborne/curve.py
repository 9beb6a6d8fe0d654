"""Smooth curves through fitted places: penalised least squares with the covariance that remains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags

LITTLE = 1e-12
"""Added to the diagonal, so that a matrix without any data can be solved."""


@dataclass(frozen=True)
class Smooth:
    """A smooth curve.

    Attributes
    ----------
    values : (n, d) array
    covariance : (n, n) array
        That of the curve, if each place has the variance 1 / weight.
    rows : (k, n) matrix
        The differences that are penalised.
    """

    values: np.ndarray
    covariance: np.ndarray
    rows: csr_matrix

    @property
    def variance(self) -> np.ndarray:
        """Variance of each place, (n,)."""
        return np.diag(self.covariance)

    @property
    def bend(self) -> np.ndarray:
        """Expected square of each penalised difference, (k,): that of the curve's, and its variance."""
        spread = self.rows.multiply(self.rows @ self.covariance).sum(axis=1)
        return ((self.rows @ self.values) ** 2).sum(axis=1) + np.asarray(spread).ravel()


def smooth(values: np.ndarray, weight: np.ndarray, rows: csr_matrix, sigma: float | np.ndarray) -> Smooth:
    """Return the curve that balances places and smoothness.

    Parameters
    ----------
    values : (n, d) array
        Places; those with a weight of 0 may hold any number.
    weight : (n,) array
        1 / variance of each.
    rows : (k, n) matrix
        Differences that are small, such as those of `differences`.
    sigma : float or (k,) array
        Their standard deviation.
    """
    stiffness = np.broadcast_to(1 / np.square(sigma), rows.shape[0])
    matrix = (rows.T @ diags(stiffness) @ rows).toarray()
    matrix[np.diag_indices(len(matrix))] += weight + LITTLE
    covariance = np.linalg.inv(matrix)
    return Smooth(covariance @ (weight[:, None] * values), covariance, rows)


def differences(count: int, order: int) -> csr_matrix:
    """Return the differences of some order between places at equal steps, (count - order, count)."""
    if count <= order:
        return csr_matrix((0, count))
    weights = np.diff(np.eye(order + 1), order, axis=0)[0]
    return diags(weights, range(order + 1), shape=(count - order, count), format="csr")
