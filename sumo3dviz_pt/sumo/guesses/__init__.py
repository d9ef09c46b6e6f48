"""Guess the vClass of vehicles whose type no file defines."""
