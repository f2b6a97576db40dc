"""Small models in MJCF as text."""

from __future__ import annotations

BALL = '<inertial pos="0.1 0.05 -0.2" quat="0.9 0.1 0.3 0.2" mass="1.5" diaginertia="0.03 0.04 0.05"/>'

# Several joints of one body, references, defaults, springs and damping of all kinds, armature, gravity compensation.
JOINTS = f"""<mujoco model="joints"><compiler angle="degree" eulerseq="XYZ"/>
<option gravity="0.5 -1 -9"/>
<default><joint armature="0.02"/><default class="stiff">
<joint stiffness="3 0.4 0.2" springref="10" damping="0.1 0.2 0.3"/></default>
</default>
<worldbody>
<body name="base" pos="0.1 0.2 1" euler="10 20 30"><joint name="x" type="slide" axis="1 0 0" ref="0.1" armature="0"/>
<joint name="yaw" pos="0.1 0 0.05" axis="0 0 1" ref="15" class="stiff"/><joint name="pitch" axis="0 1 1"/>{BALL}
<body name="arm" pos="0.3 0 0" axisangle="0 1 0 40" gravcomp="0.7"><joint name="lift" type="slide" axis="0 1 0" stiffness="7"/>
{BALL}
<body name="top" pos="0 0.1 0.4"><joint name="socket" type="ball" pos="0 0 0.1" damping="0.2" armature="0"/>{BALL}</body>
<body name="held" pos="0.1 0 0.4"><geom type="box" size="0.1 0.2 0.05" pos="0.1 0 0" mass="0.3"/></body></body></body>
<body name="flyer" pos="1 0 1" quat="0.8 0.6 0 0"><joint name="fly" type="free" armature="0" damping="0.05"/>{BALL}</body>
</worldbody></mujoco>"""

# Transmissions, laws and states of actuators; tendons through joints and sites.
DRIVEN = f"""<mujoco model="driven"><worldbody>
<site name="post" pos="0.5 0.1 0.2"/><site name="eye" pos="0.2 -0.3 0.4"/>
<body name="a"><joint name="a" axis="0 1 0"/>{BALL}<site name="on_a" pos="0.1 0 0.2" euler="10 20 30"/>
<body name="b" pos="0.3 0 0"><joint name="b" axis="1 0 0"/><joint name="slide" type="slide" axis="0 0 1"/>{BALL}
<site name="on_b" pos="0 0.2 0.1"/></body></body>
<body name="c" pos="0 1 0"><joint name="c" type="ball"/>{BALL}</body>
<body name="d" pos="0 2 0"><freejoint name="d"/>{BALL}</body>
</worldbody>
<tendon><fixed name="pair" stiffness="2 0.3 0.1" damping="0.2" springlength="0.1 0.2" armature="0.05">
<joint joint="a" coef="0.5"/><joint joint="slide" coef="-2"/></fixed>
<spatial name="rope" stiffness="5" damping="0.4" springlength="0.3"><site site="post"/><site site="eye"/><site site="on_a"/>
<site site="on_b"/></spatial></tendon>
<actuator><motor name="m" joint="a" gear="3"/><position name="p" joint="b" kp="7" kv="0.6" gear="2"/>
<velocity name="v" joint="slide" kv="2"/><general name="g" joint="a" gainprm="2 0.3 0.1" gaintype="affine" biastype="affine"
 biasprm="0.5 -0.7 0.2"/><intvelocity name="iv" joint="slide" kp="3" actrange="-1 1"/>
<general name="slow" joint="b" dyntype="filter" dynprm="0.3" gainprm="4"/><motor name="w" tendon="pair" gear="1.5"/>
<position name="r" tendon="rope" kp="3"/><motor name="ball" joint="c" gear="1 2 3"/>
<motor name="thrust" site="on_a" gear="0.1 0.2 0.3 0.4 0.5 0.6"/><motor name="free" joint="d" gear="1 2 3 4 5 6"/>
<motor name="heavy" joint="b" gear="2" armature="0.03" damping="0.2 0.1 0.3"/></actuator></mujoco>"""

# Loops by points, frames and sites, couplings of joints and tendons.
CLOSED = f"""<mujoco model="closed"><worldbody>
<body name="crank"><joint name="crank" axis="0 1 0"/>{BALL}
<body name="rod" pos="0.3 0 0"><joint name="pin" axis="0 1 0"/>{BALL}</body></body>
<body name="rocker" pos="1 0 0"><joint name="rocker" axis="0 1 0"/>{BALL}<site name="s" pos="0 0 0.4"/></body>
<body name="mate" pos="0 1 0"><freejoint name="mate"/>{BALL}</body>
<body name="k" pos="0 2 0"><joint name="k1" axis="0 1 0" ref="0.2"/>{BALL}
<body name="l" pos="0.2 0 0"><joint name="k2" axis="1 0 0"/>
<joint name="k3" axis="0 0 1"/>{BALL}</body></body></worldbody>
<tendon><fixed name="t1"><joint joint="k2" coef="2"/></fixed><fixed name="t2"><joint joint="k3" coef="-1"/></fixed></tendon>
<equality><connect name="tip" body1="rod" body2="rocker" anchor="0.7 0 0.1"/>
<weld name="glue" body1="rocker" body2="mate" relpose="0.1 0.2 0.3 0.8 0 0.6 0"/>
<joint name="law" joint1="k1" joint2="k2" polycoef="0.1 0.5 0.2 -0.1 0.05"/><tendon name="pull" tendon1="t1" tendon2="t2"
 polycoef="0 1 0.3 0 0"/></equality></mujoco>"""

HINGE = '<joint name="hinge" axis="0 1 0"{more}/><geom type="sphere" size="0.1" pos="0 0 -1" mass="2"/>'


def pendulum(more: str = "", rest: str = "") -> str:
    """One body on a hinge; more: attributes of the joint; rest: elements of the model."""
    body = f'<body name="bar">\n{HINGE.format(more=more)}</body>'
    return f'<mujoco model="pendulum">\n<worldbody>{body}</worldbody>\n{rest}</mujoco>'
