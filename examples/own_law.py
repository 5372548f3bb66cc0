"""A control law of one's own: the moments that hold the reference at rest, damping, and a spring towards it.

    softarm run --law examples/own_law.py:OwnLaw config/paper_arm.yaml
    softarm law examples/own_law.py:OwnLaw config/external_law.yaml      (beside a running softarmd)
"""

import softarm


class OwnLaw:
    spring_nm_per_rad, damper_nms_per_rad = 1.0, 0.01

    def __init__(self, experiment):
        self.arm = softarm.Arm(experiment)

    def compute(self, state):
        error, rate = state.u_ref - state.u, state.velocity_ref - state.velocity
        hold = self.arm.static_moments(state.u_ref)
        return hold + self.spring_nm_per_rad * error + self.damper_nms_per_rad * rate
