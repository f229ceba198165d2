"""The probe tests its own parts: each check measures one thing, says within which bound it must be, and names the part.

What cannot be tested is said to be not tested, with what is needed for it; nothing is taken for passed.
"""
