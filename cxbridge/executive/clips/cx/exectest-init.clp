;;; A spec in one file, to try skills by hand: loads exectest.clp with the files that it needs, after the
;;; feature skills. The rule has Fawkes' name.

(defrule spec-init
  (executive-init)
  (ff-feature-loaded skills)
  =>
  (progn$ (?file (create$ "plan.clp" "skills-actions.clp" "exectest.clp"))
    (path-load ?file)))
