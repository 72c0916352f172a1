"""Motion: weights and inertia, rates of the joints, inverse dynamics, and J⁻¹ in closed form."""
