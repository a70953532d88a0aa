;;; A spec in one file, to try skills by hand: loads the files that exectest.clp needs.

(defrule spec-init
  (executive-init)
  (ff-feature-loaded skills)
  =>
  (progn$ (?file (create$ "plan.clp" "skills-actions.clp" "exectest.clp"))
    (path-load ?file)))
