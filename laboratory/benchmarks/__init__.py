# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks. Each module measures one thing (the bake, albedos, hard cases, render times, the thesis's methods) and
prints its figures. Some also write the page of docs/ that reports them. `./dev bench NAME` runs one."""
