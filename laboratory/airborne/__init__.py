"""Simulated airborne clouds of railways with exact truth: designs, their surroundings, and the scanner above them."""
