;;; Opens the interface of the default skiller. init.clp names this file as BATCH|skills.clp: CLIPS
;;; executes the commands of the file. That is several times slower than loading a file, so the
;;; constructs for skills are in skills-calls.clp, which is loaded.

(blackboard-open-reading "SkillerInterface" "Skiller")
(assert (ff-feature-loaded skills))
