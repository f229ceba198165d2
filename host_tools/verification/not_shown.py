"""What verification cannot show, said in the document beside what it does."""

LIMITS = (
    "**That the equations are those of a patient.** Verification compares a program with mathematics. Real tissue is "
    "inhomogeneous, viscous, nonlinear otherwise than neo-Hookean, and adheres and rubs; nothing here tests that "
    "(validation needs phantoms of known content).",
    "**The paper's probe.** Face, layer moduli, slab and press are not given there; our defaults change results by "
    "tens of per cent, far more than any error on this page.",
    "**Stress at the rims.** The pressure at the very rim is infinite in the model; only forces and displacements "
    "converge there, and O1-O3 leave out the outer tenth.",
    "**Exact answers for the whole scene.** Layered probe, inclusion and sliding face together have no known solution: "
    "there only balance laws, refinement, symmetry and another program speak.",
    "**How tight a bound could be.** Bounds are not predictions. Those of 3-D, of O3's noise, of the columns in "
    "contact, of energy in small strain and of the work in finite strain were widened, and those against CalculiX in "
    "finite strain chosen, after a first measurement; read the errors, not the count of bounds that hold.",
    "**O3 of deep inclusions.** An inclusion of 10 mm or more, 12 mm deep, exceeds half its maximum over the whole central "
    "window: O3 is then the window's area, smooth but empty of information.",
    "**CalculiX's independence is not complete.** It shares the idealisation, Young's moduli, Poisson ratios and "
    "boundary conditions with ours; a wrong scene is wrong in both.",
    "**CalculiX in finite strain is fragile.** On a mesh 1.6 times finer it reached 3 mm in one of three attempts, "
    "which differed in increments and re-pairings; so the comparison stands on its coarse mesh, whose "
    "error is not measured.",
    "**What a sharp rim does in finite strain.** Whether the edge drives out the tissue that slides around it changes "
    "the inclusion field by 1-2 % and the force at 3 mm by 3 %; a real edge is rounded, and its radius decides.",
    "**Finite strain off the axis, under a dome, or near incompressibility**: no model of ours, so no benchmark.",
    "**Hayes' published values** are quoted from memory except for a Poisson ratio of 0.5; the benchmark is the "
    "integral equation, which we solved ourselves.",
    "**3-D convergence.** Solids are compared on coarse meshes; their errors are those of these meshes.",
)
