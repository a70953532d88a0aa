;;; Goals: what they are, how trees of them go away, and the facts attached to them.
;;;
;;; The life of a goal:
;;;   FORMULATED -> SELECTED -> EXPANDED -> COMMITTED -> DISPATCHED -> FINISHED
;;;              -> EVALUATED -> RETRACTED
;;; A leaf is moved by the user's reasoner and by action selection, a goal with
;;; sub-goals by the rules of its sub-type (goals/*.clp).
;;;
;;; Rules match goals by joins on id and parent, which CLIPS hashes. Nothing here looks
;;; through all goals or plans when one of them changes.

(deftemplate goal
  "Something to achieve or to keep up."
  (slot id (type SYMBOL))
  (slot class                ; what kind of goal: expanders look at this
    (type SYMBOL))
  (slot type                 ; MAINTAIN goals never end; sub-type rules leave them alone
    (type SYMBOL) (allowed-values ACHIEVE MAINTAIN) (default ACHIEVE))
  (slot sub-type             ; how sub-goals are pursued, nil for a leaf
    (type SYMBOL))
  (slot parent               ; id of the goal above, nil for a root
    (type SYMBOL))
  (slot mode
    (type SYMBOL)
    (allowed-values FORMULATED SELECTED EXPANDED COMMITTED
                    DISPATCHED FINISHED EVALUATED RETRACTED))
  (slot outcome              ; known from FINISHED on
    (type SYMBOL) (allowed-values UNKNOWN COMPLETED FAILED REJECTED))
  (multislot warning)
  (multislot error)          ; a code for programs, such as SUB-GOAL-FAILED, and details
  (slot message              ; the same for people
    (type STRING))
  (slot priority             ; the greater goes first
    (type FLOAT) (default 0.0))
  (multislot params)         ; given with the goal: key value, key value ...
  (multislot meta)           ; kept by reasoners while the goal lives
  (slot meta-fact            ; index of a fact with a slot goal-id, 0 for none ...
    (type INTEGER) (default 0))
  (slot meta-template        ; ... and its template; either of the two is enough
    (type SYMBOL))
  (multislot required-resources   ; DISPATCHED only when all of them are acquired
    (type SYMBOL))
  (multislot acquired-resources   ; to be given back once RETRACTED
    (type SYMBOL))
  (slot committed-to         ; id of the plan, or of the sub-goal
    (type SYMBOL))
  (slot verbosity
    (type SYMBOL) (allowed-values QUIET DEFAULT NOISY) (default DEFAULT))
  (slot is-executable        ; could be expanded as things are now
    (type SYMBOL) (allowed-values TRUE FALSE) (default FALSE)))

;; Nobody can be the sub-goal of a goal without an id, since nil says that there is no parent.
(defrule goal-without-id
  "A goal that its maker gave no id gets <class>-genN, as goals in trees do."
  (declare (salience ?*SALIENCE-FIRST*))
  ?goal <- (goal (id nil) (class ?class) (mode FORMULATED))
  =>
  (cx-modify-goal ?goal (id (sym-cat ?class - (gensym*)))))

(deffunction goal-param-positive (?params ?name)
  "TRUE when the parameters are exactly: the name and a number above zero."
  (if (or (<> 2 (length$ ?params)) (neq ?name (nth$ 1 ?params))) then (return FALSE))
  (bind ?value (nth$ 2 ?params))
  (if (numberp ?value) then (> ?value 0) else FALSE))

(defrule goal-print-error
  (goal (id ?id) (class ?class) (mode RETRACTED) (outcome FAILED)
        (error ?code $?details) (message ?message&~""))
  =>
  (printout error "Goal " ?id " (" ?class ") failed: " ?message " " (create$ ?code ?details) crlf))

;; ---- goals and their plans go away

(deffunction goal-retract-goal-tree (?id)
  "Retract the goal, everything below it and all their plans, at once.
   For rules of users: it looks through all goals once a level of the tree, and through
   all plans once. The core itself asserts (goal-tree-retract ID) instead."
  (bind ?level (if (eq ?id nil) then (create$) else (create$ ?id)))
  (bind ?tree (create$))
  (while (> (length$ ?level) 0)
    (bind ?tree (create$ ?tree ?level))
    (bind ?below (create$))
    (do-for-all-facts ((?g goal)) (member$ ?g:parent ?level)
      (if (not (member$ ?g:id ?tree)) then (bind ?below (create$ ?below ?g:id))))
    (bind ?level ?below))
  (delayed-do-for-all-facts ((?action plan-action)) (member$ ?action:goal-id ?tree)
    (retract ?action))
  (delayed-do-for-all-facts ((?plan plan)) (member$ ?plan:goal-id ?tree)
    (retract ?plan))
  (delayed-do-for-all-facts ((?g goal)) (member$ ?g:id ?tree)
    (retract ?g)))

(defrule goal-retract
  "A root, or a child of a goal that never ends, is over when it holds nothing any more."
  (confval (path "/clips-executive/automatic-goal-retraction") (type BOOL) (value TRUE))
  (goal (id ?id) (mode RETRACTED) (parent ?parent) (acquired-resources))
  (or (test (eq ?parent nil))
      (goal (id ?parent&~nil) (type MAINTAIN)))
  =>
  (printout t "Retracting goal " ?id crlf)
  (assert (goal-tree-retract ?id)))

(defrule goal-tree-retract-children
  (declare (salience ?*SALIENCE-FIRST*))
  (goal-tree-retract ?id&~nil)
  (goal (id ?child&~?id) (parent ?id))
  =>
  (assert (goal-tree-retract ?child)))

(defrule goal-tree-retract-leaf
  "Nothing is left below the goal."
  (declare (salience ?*SALIENCE-FIRST*))
  ?request <- (goal-tree-retract ?id)
  (not (goal (id ~?id) (parent ?id&~nil)))
  (not (plan (goal-id ?id)))
  (not (plan-action (goal-id ?id)))
  ?goal <- (goal (id ?id))
  =>
  (retract ?goal ?request))

(defrule goal-tree-retract-ring
  "No goal of a ring is a leaf. When all others are gone it opens anywhere; the rest is a tree."
  (declare (salience ?*SALIENCE-FIRST-LATE*))
  ?request <- (goal-tree-retract ?id)
  (goal-tree-retract ?child&~?id)
  (goal (id ?child) (parent ?id))
  ?goal <- (goal (id ?id))
  =>
  (retract ?goal ?request))

(defrule goal-tree-retract-nothing
  "Somebody else retracted the goal meanwhile."
  (declare (salience ?*SALIENCE-FIRST*))
  ?request <- (goal-tree-retract ?id)
  (not (goal (id ?id)))
  =>
  (retract ?request))

(defrule goal-cleanup-plans
  "Before anybody reacts to RETRACTED: a goal that is tried again must meet no old plan."
  (declare (salience ?*SALIENCE-HIGH*))
  (confval (path "/clips-executive/automatic-goal-retraction") (type BOOL) (value TRUE))
  (goal (id ?id) (mode RETRACTED))
  (plan (goal-id ?id) (id ?plan-id))
  =>
  (assert (goal-plan-retract ?id ?plan-id)))

(defrule goal-tree-retract-plan
  (declare (salience ?*SALIENCE-FIRST*))
  (goal-tree-retract ?id)
  (plan (goal-id ?id) (id ?plan-id))
  =>
  (assert (goal-plan-retract ?id ?plan-id)))

(defrule goal-tree-retract-action-without-plan
  (declare (salience ?*SALIENCE-FIRST*))
  (goal-tree-retract ?id)
  ?action <- (plan-action (goal-id ?id) (plan-id ?plan-id))
  (not (plan (goal-id ?id) (id ?plan-id)))
  =>
  (retract ?action))

(defrule goal-plan-retract-action
  (declare (salience ?*SALIENCE-FIRST*))
  (goal-plan-retract ?id ?plan-id)
  ?action <- (plan-action (goal-id ?id) (plan-id ?plan-id))
  =>
  (retract ?action))

(defrule goal-plan-retract-done
  (declare (salience ?*SALIENCE-FIRST*))
  ?request <- (goal-plan-retract ?id ?plan-id)
  (not (plan-action (goal-id ?id) (plan-id ?plan-id)))
  ?plan <- (plan (goal-id ?id) (id ?plan-id))
  =>
  (retract ?plan ?request))

;; ---- meta facts: application data of a goal, in a fact with a slot goal-id

;; Private: the address behind goal.meta-fact. To ask an address whether its fact still
;; exists costs nothing; to look for an index means to walk through all facts.
(deftemplate goal-meta-link
  (slot goal-id) (slot index) (slot fact))

(deffunction goal-meta-template-known (?template)
  "TRUE when such a template exists (FALSE for nil)."
  (and (neq ?template nil)
       (neq FALSE (member$ ?template (get-deftemplate-list)))))

(deffunction goal-meta-template-usable (?template)
  "TRUE when the template exists and has a slot goal-id."
  (and (goal-meta-template-known ?template)
       (deftemplate-slot-existp ?template goal-id)))

(deffunction goal-meta-find (?template ?id)
  "Index of the first fact of the template for the goal, 0 when there is none."
  (do-for-fact ((?meta ?template)) (eq ?meta:goal-id ?id)
    (return (fact-index ?meta)))
  0)

(deffunction goal-meta-count (?template ?id)
  "How many facts of the template there are for the goal."
  (length$ (find-all-facts ((?meta ?template)) (eq ?meta:goal-id ?id))))

(defrule goal-meta-template-invalid
  (declare (salience ?*SALIENCE-FIRST*))
  (goal (id ?id) (mode ~RETRACTED)
        (meta-template ?template&~nil&:(not (goal-meta-template-known ?template))))
  =>
  (printout error "Goal " ?id " attached goal meta template '" ?template "' unknown" crlf))

(defrule goal-meta-fact-template-missing-goal-id
  (declare (salience ?*SALIENCE-FIRST*))
  (goal (id ?id) (meta-fact ~0) (meta-template ?template&~nil))
  (test (and (goal-meta-template-known ?template)
             (not (deftemplate-slot-existp ?template goal-id))))
  =>
  (printout error "Goal " ?id " uses meta fact '" ?template "' without slot 'goal-id'" crlf))

(defrule goal-meta-fact-init-fact-id
  "A fact of the template is already there."
  (declare (salience ?*SALIENCE-HIGH*))
  ?goal <- (goal (id ?id) (meta-fact 0) (meta-template ?template&~nil))
  (test (and (goal-meta-template-usable ?template) (> (goal-meta-find ?template ?id) 0)))
  =>
  (cx-modify-goal ?goal (meta-fact (goal-meta-find ?template ?id))))

(defrule goal-assert-default-meta
  "No fact of the template is there: make one of defaults."
  (declare (salience ?*SALIENCE-HIGH*))
  ?goal <- (goal (id ?id) (meta-fact 0) (mode FORMULATED) (verbosity ?verbosity)
                 (meta-template ?template&~nil))
  (test (and (goal-meta-template-usable ?template) (eq 0 (goal-meta-find ?template ?id))))
  =>
  (bind ?meta (cx-assert-data (str-cat "(" ?template " (goal-id " ?id "))")))
  (cx-modify-goal ?goal (meta-fact (fact-index ?meta)))
  (if (eq ?verbosity NOISY) then
    (printout t "Goal " ?id " attached default meta fact from template " ?template crlf)))

(defrule goal-meta-link-new
  (declare (salience ?*SALIENCE-HIGH*))
  (goal (id ?id) (meta-fact ?index&~0))
  (not (goal-meta-link (goal-id ?id) (index ?index)))
  =>
  (assert (goal-meta-link (goal-id ?id) (index ?index)
                          (fact (if (fact-existp ?index) then (fact-index-to-fact ?index))))))

(defrule goal-meta-link-outdated
  (declare (salience ?*SALIENCE-HIGH*))
  ?link <- (goal-meta-link (goal-id ?id) (index ?index))
  (not (goal (id ?id) (meta-fact ?index)))
  =>
  (retract ?link))

(defrule goal-update-meta-template
  "The fact is what counts: the template follows it."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-meta-link (goal-id ?id) (index ?index) (fact ?fact&~FALSE))
  ?goal <- (goal (id ?id) (meta-fact ?index) (meta-template ?template))
  (test (and (fact-existp ?fact) (neq ?template (fact-relation ?fact))))
  =>
  (cx-modify-goal ?goal (meta-template (fact-relation ?fact))))

(defrule goal-meta-fact-init-goal-id
  "The fact belongs to the goal that points to it."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-meta-link (goal-id ?id) (index ?index) (fact ?fact&~FALSE))
  (goal (id ?id) (meta-fact ?index))
  (test (and (fact-existp ?fact)
             (deftemplate-slot-existp (fact-relation ?fact) goal-id)
             (neq ?id (fact-slot-value ?fact goal-id))))
  =>
  (modify ?fact (goal-id ?id)))

(defrule goal-meta-ambiguous-meta-facts
  "Asked once for each fact that a goal is linked to."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-meta-link (goal-id ?id) (fact ?fact&~FALSE))
  (test (and (fact-existp ?fact)
             (deftemplate-slot-existp (fact-relation ?fact) goal-id)
             (> (goal-meta-count (fact-relation ?fact) ?id) 1)))
  =>
  (printout error "Goal " ?id " has ambiguous meta facts" crlf))

(defrule goal-meta-fact-update
  "The fact is gone. It may have been modified, then a newer one stands in for it."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-meta-link (goal-id ?id) (index ?index) (fact ?fact))
  ?goal <- (goal (id ?id) (meta-fact ?index) (meta-template ?template&~nil))
  (time $?)  ; ask again with each tick
  (test (or (eq ?fact FALSE) (not (fact-existp ?fact))))
  =>
  (bind ?newer 0)
  (if (goal-meta-template-usable ?template) then
    (bind ?newer (goal-meta-find ?template ?id)))
  (if (> ?newer 0)
   then (cx-modify-goal ?goal (meta-fact ?newer))
   else (cx-modify-goal ?goal (meta-fact 0) (meta-template nil))))

(defrule goal-cleanup-meta-facts
  "Before the goal itself can go."
  (declare (salience ?*SALIENCE-HIGH*))
  (confval (path "/clips-executive/automatic-goal-retraction") (type BOOL) (value TRUE))
  (goal-meta-link (goal-id ?id) (index ?index) (fact ?fact&~FALSE))
  ?goal <- (goal (id ?id) (meta-fact ?index) (mode RETRACTED))
  (test (fact-existp ?fact))
  =>
  (retract ?fact)
  (cx-modify-goal ?goal (meta-fact 0)))
