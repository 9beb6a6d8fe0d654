"""Inputs other than clouds, each checked in one place whether QGIS or the packages of a command line read it."""
