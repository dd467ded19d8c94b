"""Captions of the figures of the reports, by the names of the figures."""

RECORDING = {
    "fit": "Each channel as it was measured, and as the estimate predicts it. Held-out windows "
    "were not used for the fit: there the two lines agree only if the estimate is right.",
    "residuals": "The residual over time, and its spectrum beside that of the signal. A flat "
    "spectrum is noise; a peak is a vibration, a cable or a wrong delay. An arrow at the edge "
    "points to an outlier beyond it; the dotted line is the cutoff of the low-pass.",
    "parameters": "The estimate from all data up to each time. The dashed line is the result.",
    "excitation": "Ten directions in the space of the parameters, each named by its largest "
    "components; the inertia is that about the frame's origin here, and mass*com x the first "
    "moment along x. A faint direction is known badly.",
    "ellipsoid": "The uniform solid ellipsoid with this mass and inertia in its place in the "
    "frame. The payload should have about its size and attitude.",
    "point": "The centre of mass in the frame.",
}

AT_REST = RECORDING | {
    "fit": "Each channel in each pose as it was measured, and as the estimate predicts it.",
    "residuals": "The residual of each pose. One that is far larger than the others shows a "
    "contact, or a pose that is not the given one. An arrow at the edge points to the residual of "
    "a pose that was left out, whose size stands beside it.",
}

COMBINATION = {
    "values": "Each value with its 95 % interval, from each recording alone and from all together "
    "(the band). Recordings that agree have intervals that overlap.",
}

MOTION = {
    "motion": "Position, velocity and acceleration of the joints that move; in m in place of rad "
    "for a prismatic joint.",
    "intervals": "Half of each 95 % interval that the motion up to each time is predicted to give, "
    "in percent of the largest expected value of its kind. The line is the target.",
    "base": "Largest angle by which the base has turned up to each time, with the expected "
    "payload. The bound holds for the other payloads, too, which may turn the base further: see "
    "the limits.",
}
