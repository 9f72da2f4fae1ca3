"""Recordings of mechanisms with concealed physics, integrated with hard laws.

Shares no code, no constants and no method with the project's simulator, which it judges: adaptive
Dormand-Prince 5(4) with every stop, reversal and breakaway located by bisection, instead of fixed
Runge-Kutta steps.

    system.py      a rig, its true values and what is concealed, as arrays
    laws.py        forces and rates
    motion.py      the integrator, and a recording with noise, quantisation and a controller
    rigs.py        families of rigs at random scales
    effects.py     every kind of the vocabulary at random strength; what is outside the vocabulary
    excitation.py  inputs and references a sensible engineer would use
    visibility.py  what a refit of the believed model leaves of an effect
    cases.py       cases and their truth, written to two separate folders
"""
