;;; Loads what agents plan with, once the feature is there.

(defrule pddl-init-pddl-psys2
  (executive-init)
  (ff-feature-loaded plansys2)
  =>
  (path-load "pddl.clp")
  (assert (using-psys2)))
