"""Dialogs: parameters, help, and the values that a user enters."""
